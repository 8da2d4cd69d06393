"""Thumbnails of matt materials, drawn together: the pictures that each has alone, in their order."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.runtime.errors import InputError
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM
from metamer.viewer.gl.backend import gl_session
from metamer.viewer.picture import display_for, display_pass, material_cut_out
from metamer.viewer.render.matt_forms import matt_form
from metamer.viewer.sheets import preview
from metamer.viewer.sheets.preview import thumbnail_scene, thumbnails
from metamer.viewer.software.backend import software_session

PIXELS = 16


@pytest.fixture(scope="module")
def scene():
    found = thumbnail_scene("")
    return replace(found, cameras=(replace(found.camera(), width=PIXELS, height_px=PIXELS),))


@pytest.fixture
def mixed(tmp_path, write_matt, write_spectrum, tiny_catalogue):
    """A light, matt materials of several colours, one that is glossy, and one that is damaged, in turn."""
    folder = tmp_path / "cat"
    write_matt(folder, "a/red", np.where(WORKING_WAVELENGTHS_NM < 600, 0.05, 0.8))
    write_matt(folder, "c/green", np.where(abs(WORKING_WAVELENGTHS_NM - 540) < 40, 0.6, 0.1))
    write_matt(folder, "e/grey", 0.2)
    write_spectrum(folder, "b/led")
    (folder / "tiny").mkdir()
    (folder / "tiny" / "copper.h5").write_bytes((tiny_catalogue / "tiny" / "copper.h5").read_bytes())
    damaged = write_matt(folder, "d/damaged", 0.5)
    damaged.write_bytes(damaged.read_bytes()[:-200] + bytes(200))
    return Catalogue.open(folder)


@pytest.mark.parametrize("kind", ["software", "gl"])
def test_pictures_are_those_of_each_alone(request, mixed, scene, kind, monkeypatch):
    """To the last code or one beside it, which rounding decides; also where a block ends between them."""
    monkeypatch.setattr(preview, "_AT_ONCE", 4)
    session = software_session() if kind == "software" else gl_session(request.getfixturevalue("gl"))
    with session as renderer:
        found = list(thumbnails(mixed, mixed.query(), scene, renderer, PIXELS))
        display = display_for(scene)
        on = display_pass(renderer, display)
        assert [one.summary.id for one in found] == ["a/red", "b/led", "c/green", "d/damaged", "e/grey", "tiny/copper"]
        for one in found:
            if one.summary.id in ("b/led", "d/damaged"):
                continue
            alone = material_cut_out(mixed.load(one.summary.id), scene, renderer, display, on)
            assert np.abs(one.picture.astype(int) - alone).max() <= 1, one.summary.id
        assert found[3].reason and not found[2].reason


def test_forms_of_one_shape_are_told_from_others(mixed, tiny_catalogue):
    forms = {name: matt_form(mixed.load(name).drawn()) for name in ("a/red", "e/grey", "tiny/copper")}
    assert forms["tiny/copper"] is None and forms["a/red"].key == forms["e/grey"].key
    rough = Catalogue.open(tiny_catalogue).load("tiny/rough-blue").drawn()
    assert (found := matt_form(rough)) is None or found.key != forms["a/red"].key
    one = forms["a/red"].form
    darker = replace(
        one, packs=(replace(one.packs[0], factors=(one.packs[0].factors[0] * 0.5, *one.packs[0].factors[1:])),)
    )
    assert matt_form(darker).key != forms["a/red"].key


def test_a_factor_may_stand_in_the_shape_or_in_the_spectrum(mixed, scene):
    """A fit leaves it wherever it ends up."""
    form = mixed.load("a/red").drawn()
    around = form.environment_form()
    palette = replace(around.palette, values=around.palette.values / -3.0)
    moved = replace(form, slices=replace(around, value=around.value * -3.0, palette=palette))
    one, other = (matt_form(each) for each in (form, moved))
    assert one.key == other.key and one.scale != other.scale
    with software_session() as renderer:
        (xyz, _), (again, _) = renderer.render_matt(scene, scene.reviewed_part, [one, other])
    np.testing.assert_allclose(again, xyz, rtol=1e-5, atol=1e-7)


def test_light_between_surfaces_is_refused(mixed, scene):
    with software_session() as renderer, pytest.raises(InputError, match="light between surfaces"):
        renderer.render_matt(replace(scene, bounces=1), "sphere", [matt_form(mixed.load("e/grey").drawn())])
