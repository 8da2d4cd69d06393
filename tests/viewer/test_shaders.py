"""Every shader that ships compiles, and a compiler's message names files."""

import pytest
from metamer.benchmarks import shading
from metamer.viewer import passes, shaders

PROGRAMS = (*passes.PROGRAMS, *shading.PROGRAMS)


@pytest.mark.parametrize(("vertex", "fragment", "sizes"), PROGRAMS)
def test_every_program_compiles(gl, vertex, fragment, sizes):
    shaders.program(gl, vertex, fragment, sizes).release()


def test_every_shader_file_is_part_of_a_program():
    used = {
        name for vertex, fragment, sizes in PROGRAMS for f in (vertex, fragment) for name in shaders.source(f, sizes)[1]
    }
    assert used == {file.name for file in shaders._folder().iterdir()}


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


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        ("1:17(5): error: no", "b.glsl:17(5): error: no"),
        ("1(17) : error C0000", "b.glsl:17) : error C0000"),
        ("ERROR: 0:3: no", "ERROR: a.frag:3: no"),
        ("9:3: no such source", "9:3: no such source"),
    ],
)
def test_places_of_several_drivers_are_read(message, expected):
    assert shaders.with_file_names(message, ("a.frag", "b.glsl")) == expected
