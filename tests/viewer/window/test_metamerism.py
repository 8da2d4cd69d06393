"""Metamerism of materials: which light and observer part a pair, worst first, and how to see it."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.runtime.errors import InputError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.formula import formula
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM
from metamer.viewer.window.choices import Choices
from metamer.viewer.window.metamerism import REFERENCE, metamerism, session_of_cell
from metamer.viewer.window.state import Session

LIGHTS = {"D65": None, "A": None, "FL11": None}
OBSERVERS = ("1931_2", "1964_10")


def metamer_of(reflectance):
    """Another spectrum of the same XYZ under the reference conditions: the first and a multiple of a black."""
    weights = observer(REFERENCE.observer).weights(illuminant(REFERENCE.illuminant), WORKING_WAVELENGTHS_NM)
    wave = np.sin((WORKING_WAVELENGTHS_NM - 380.0) / 20.0)
    black = wave - np.linalg.pinv(weights) @ (weights @ wave)
    return reflectance + 0.1 * black / np.abs(black).max()


@pytest.fixture(scope="module")
def grey():
    return 0.4 + 0.1 * np.sin((WORKING_WAVELENGTHS_NM - 380.0) / 90.0)


@pytest.fixture
def materials(tmp_path, write_matt, grey):
    write_matt(tmp_path, "a/standard", grey)
    write_matt(tmp_path, "a/metamer", metamer_of(grey))
    write_matt(tmp_path, "a/lighter", grey + 0.05)
    catalogue = Catalogue.open(tmp_path)
    return [catalogue[f"a/{name}"] for name in ("standard", "metamer", "lighter")]


def test_a_metameric_pair_matches_in_one_light_and_parts_in_others(materials):
    found = metamerism(materials[:2], LIGHTS, OBSERVERS, formula("94"))
    by = {one.conditions.words: one for one in found.cells}
    assert by["D65, 1964_10"].delta_e < 0.02 and found.cells[-1] == by["D65, 1964_10"]
    assert by["FL11, 1931_2"].delta_e > 1.0 and by["A, 1964_10"].delta_e > 1.0
    each = [one.delta_e for one in found.cells]
    assert each == sorted(each, reverse=True) and len(each) == 6


def test_differences_are_those_of_the_instrument_s_reading(materials):
    found = metamerism(materials, LIGHTS, OBSERVERS, formula("CIE 2000"))
    for cell in found.cells:
        light, eye = illuminant(cell.conditions.illuminant), observer(cell.conditions.observer)
        sample = next(one for one in materials if one.id == cell.material)
        pair = [one.reading().xyz(light, eye) for one in (materials[0], sample)]
        assert cell.delta_e == pytest.approx(float(delta_e_xyz(*pair, eye.white(light), "CIE 2000")), abs=1e-9)


def test_an_index_takes_off_what_is_off_in_the_reference_light(materials):
    """A lighter grey differs everywhere, but hardly by the light."""
    found = metamerism([materials[0], materials[2]], LIGHTS, OBSERVERS, formula("94"))
    assert min(one.delta_e for one in found.cells) > 3.0
    assert max(one.index for one in found.cells) < 0.3


def test_a_table_has_the_worst_condition_and_material_first(materials):
    found = metamerism(materials, LIGHTS, OBSERVERS, formula("94"))
    conditions, rows = found.table()
    assert conditions[0] == found.cells[0].conditions and next(iter(rows)) == found.cells[0].material
    assert len(conditions) == 6 and all(len(row) == 6 for row in rows.values())
    assert rows[found.cells[-1].material][conditions.index(found.cells[-1].conditions)] == found.cells[-1].delta_e


def test_any_lamp_parts_materials_and_has_no_index(materials):
    lamps = {"my lamp": illuminant("FL11"), "FL11": None}
    found = metamerism(materials[:2], lamps, ("1931_2",), formula("94"))
    mine, named = sorted(found.cells, key=lambda one: one.conditions.illuminant, reverse=True)
    assert mine.delta_e == named.delta_e and mine.index is None and "no name" in mine.no_index
    assert named.index is not None


def test_a_metal_has_differences_but_no_index(tiny_catalogue):
    catalogue = Catalogue.open(tiny_catalogue)
    pair = [catalogue["tiny/matt-red"], catalogue["tiny/copper"]]
    found = metamerism(pair, {"D65": None}, ("1931_2",), formula("94"))
    assert found.cells[0].delta_e > 1.0 and found.cells[0].index is None and "effect" in found.cells[0].no_index


@pytest.mark.parametrize("count", [0, 1])
def test_too_few_materials_are_refused(materials, count):
    with pytest.raises(InputError, match="too few"):
        metamerism(materials[:count], LIGHTS, OBSERVERS, formula("94"))


def test_a_material_beside_itself_is_refused(materials):
    with pytest.raises(InputError, match="beside itself"):
        metamerism([materials[0], materials[0]], LIGHTS, OBSERVERS, formula("94"))


def test_a_cell_that_is_chosen_is_seen(materials):
    found = metamerism(materials, LIGHTS, OBSERVERS, formula("94"))
    before = replace(Session(), light=replace(Session().light, dimming=0.5))
    after = session_of_cell(before, found.cells[0], found.standard, Choices(part="body"))
    assert after.material_of("body") == "a/standard" and after.other.material == found.cells[0].material
    assert after.light.lamps[0].name == found.cells[0].conditions.illuminant and after.light.dimming == 0.5
    assert after.observer == found.cells[0].conditions.observer
