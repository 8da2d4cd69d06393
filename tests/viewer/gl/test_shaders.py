"""Every shader that ships compiles, and a compiler's message names files."""

import re
import shutil
from pathlib import Path

import pytest
from metamer.benchmarks import shading
from metamer.materials.factored import pack
from metamer.materials.factored.pyramids import MOST_LEVELS
from metamer.materials.slices import view_slices
from metamer.viewer.gl import passes, shaders

FACTORS = Path(pack.__file__).with_name("factors.glsl")
SLICES = Path(view_slices.__file__).with_name("view_slices.glsl")
LIGHT = {"ENVIRONMENT_LEVELS": 15, "SOFTENING": 2.0, "IRRADIANCE_SIDE": 128, "ROW_LENGTH": 4096, "BENT": 9}
LIGHT |= {"FIELDS": 1, "ROWS_A_CALL": 1}
HIDDEN = {"HIDDEN": 1, "MAP_QUADS": 11, "MAP_SIDE": 32, "SITES_A_ROW": 227, "MAP_SOFT": 0.785, "MOST_BENT": 0.964}
# Sizes for an environment; softboxes have no bright parts.
BRIGHT = {**HIDDEN, "MOST_BRIGHT": 16, "LIT_A_ROW": 409}
PANEL = {"PANEL": 1, "PANEL_CELLS": 16, "PANEL_NODES": 8}
SEVERAL = {**BRIGHT, "FIELDS": 3, "ROWS_A_CALL": 3, "SPECTRA": 3}
INDIRECT = {"INDIRECT": 1, "INDIRECT_A_ROW": 195, "EVEN_Z": 0.667, "EVEN_ZZ": 0.5}
PROGRAMS = (
    *(
        ("fullscreen.vert", "gather.frag", {**LIGHT, "LOBES": 12, "POLAR": 24, "AZIMUTHS": azimuths, **hidden}, SLICES)
        for azimuths in (1, 16)
        for hidden in (
            {},
            BRIGHT,
            {**BRIGHT, "FIELDS": 3, "ROWS_A_CALL": 3, "SPECTRA": 3},
            PANEL,
            {**PANEL, **HIDDEN},
            INDIRECT,
        )
    ),
    *((*row, None) for row in passes.PROGRAMS),
    ("fullscreen.vert", "marked.frag", {}, None),
    *(("fullscreen.vert", "enlarge.frag", kind, None) for kind in ({}, {"DOWN": 1})),
    *(("fullscreen.vert", "compare.frag", {kind: 1}, None) for kind in ("ONE", "TWO", "MAP")),
    *(
        ("fullscreen.vert", "put.frag", sizes, None)
        for sizes in ({"PICTURE": 1}, {"COVERAGE": 1}, {"PICTURE": 1, "COVERAGE": 1}, {"PICTURE": 1, "ALPHA": 1})
    ),
    *(("fullscreen.vert", "difference.frag", {"FORMULA": number}, None) for number in (1994, 2000, 16)),
    *((*row, FACTORS) for row in shading.PROGRAMS),
    *(
        ("fullscreen.vert", "shade.frag", {"AXES": axes, "MIXED": 1, **written, **mipmapped}, FACTORS)
        for mipmapped in ({}, {"MIPMAPPED": 1, "MOST_LEVELS": MOST_LEVELS})
        for axes in (3, 4)
        for written in (*passes.FOLDED, *passes.KEPT)
    ),
)


@pytest.mark.parametrize(("vertex", "fragment", "sizes", "terms"), PROGRAMS)
def test_every_program_compiles(gl, vertex, fragment, sizes, terms):
    shaders.program(gl, vertex, fragment, sizes, terms).release()


def test_every_shader_file_is_part_of_a_program():
    used = {
        name
        for vertex, fragment, sizes, terms in PROGRAMS
        for file in (vertex, fragment)
        for name in shaders.source(file, sizes, terms)[1]
    }
    assert used == {file.name for file in shaders.shader_folder().iterdir()} | {FACTORS.name, SLICES.name}


def test_no_shader_rounds_down_a_quotient_that_may_be_whole():
    """GPUs divide to within a few units in the last place: 33 / 33 may be below 1, and a wrapped texel another."""
    package = Path(shaders.__file__).parents[2]
    texts = {
        file: file.read_text("utf-8") for room in ("materials", "viewer") for file in (package / room).rglob("*.glsl")
    }
    texts |= {file: file.read_text("utf-8") for file in shaders.shader_folder().glob("*.frag")}
    assert len(texts) > 30
    found = [(file.name, one) for file, text in texts.items() for one in re.findall(r"\bfloor\(.*/.*", text)]
    assert len(found) >= 3
    assert [one for one in found if "+ 0.5" not in one[1]] == []


def test_an_include_is_put_in_once_and_lines_are_counted_per_file():
    text, names = shaders.source("light.frag", {"DIRECTIONAL": 1})
    assert text.startswith(f"{shaders.GLSL_VERSION}\n#define DIRECTIONAL 1\n#line 1 0\n")
    assert names[0] == "light.frag" and len(set(names)) == len(names)
    assert text.count("float arc(float y, float x)") == 1
    assert "#include" not in text


def test_a_missing_include_says_who_asks_for_it(monkeypatch, tmp_path):
    (tmp_path / "shaders").mkdir()
    (tmp_path / "shaders" / "top.frag").write_text('\n#include "nowhere.glsl"\n')
    monkeypatch.setattr(shaders, "files", lambda _package: tmp_path)
    with pytest.raises(shaders.ShaderError, match=r"top\.frag:2: there is no shader file 'nowhere\.glsl'"):
        shaders.source("top.frag")


def test_a_compiler_error_names_the_included_file_and_its_line(gl, monkeypatch, tmp_path):
    folder = tmp_path / "shaders"
    folder.mkdir()
    (folder / "all.vert").write_text("void main() { gl_Position = vec4(0.0); }\n")
    (folder / "top.frag").write_text('#include "part.glsl"\nout vec4 colour;\nvoid main() { colour = f(); }\n')
    (folder / "part.glsl").write_text("vec4 f() {\n    return nonsense;\n}\n")
    monkeypatch.setattr(shaders, "files", lambda _package: tmp_path)
    with pytest.raises(shaders.ShaderError, match=r"part\.glsl:2"):
        shaders.program(gl, "all.vert", "top.frag")


@pytest.mark.parametrize(("fragment", "form"), [("shade.frag", FACTORS), ("gather.frag", SLICES)])
@pytest.mark.parametrize("line", ["vec4 f() { return nonsense; }", "vec4 f( { }", "#error no such form"])
def test_an_error_in_a_forms_own_file_names_it_in_every_pass(gl, tmp_path, fragment, form, line):
    text = form.read_text("utf-8")
    (tmp_path / "wrong.glsl").write_text(f"{text}{line}\n")
    sizes = {**LIGHT, **HIDDEN, "AXES": 3, "MIXED": 1, "LOBES": 12, "POLAR": 24, "AZIMUTHS": 1}
    place = rf"\nwrong\.glsl:{len(text.splitlines()) + 1}[(:]"
    with pytest.raises(shaders.ShaderError, match=place) as refused:
        shaders.program(gl, "fullscreen.vert", fragment, sizes, tmp_path / "wrong.glsl")
    assert str(refused.value).startswith(f"fullscreen.vert + {fragment}: ")


@pytest.mark.parametrize("fragment", ["gather.frag", "frames.frag", "fold.frag", "uv.frag", "light.frag"])
def test_an_error_in_a_pass_names_that_pass(gl, monkeypatch, tmp_path, fragment):
    shutil.copytree(shaders.shader_folder(), tmp_path / "shaders")
    text = (tmp_path / "shaders" / fragment).read_text()
    (tmp_path / "shaders" / fragment).write_text(f"#error here\n{text}")
    monkeypatch.setattr(shaders, "files", lambda _package: tmp_path)
    with pytest.raises(shaders.ShaderError, match=rf"\n{fragment.replace('.', chr(92) + '.')}:1\b"):
        shaders.program(gl, "fullscreen.vert", fragment, {**LIGHT, **HIDDEN}, SLICES)


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        ("1:17(5): error: no", "b.glsl:17(5): error: no"),
        ("1(17) : error C0000", "b.glsl:17: error C0000"),
        ("ERROR: 0:3: no", "ERROR: a.frag:3: no"),
        ("9:3: no such source", "9:3: no such source"),
    ],
)
def test_places_of_several_drivers_are_read(message, expected):
    assert shaders.with_file_names(message, ("a.frag", "b.glsl")) == expected
