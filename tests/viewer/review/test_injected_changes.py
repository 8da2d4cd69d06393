"""Known changes between two reviews: each is found, or lies below what is stated; repeats raise no alarm."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from metamer.calibration.regression.comparison import compare
from metamer.calibration.regression.criteria import default_criteria
from metamer.calibration.regression.picture_files import SeenSpectra
from metamer.calibration.regression.sources import side_of
from metamer.lighting.lights import DirectionalLight
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.runtime.errors import ComparisonError
from metamer.spectral.formats.exr import read_exr, write_exr
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM
from metamer.viewer.catalogue_side import catalogue_side, is_catalogue
from metamer.viewer.review.review import review
from metamer.viewer.software.backend import software_session

LIGHTS = ("D65", "A")
CURVE = 0.4 + 0.2 * np.sin(np.linspace(0.0, 5.0, WORKING_WAVELENGTHS_NM.size))


def metamer_of(curve):
    """Another curve of the same XYZ under D65 for the CIE 1931 observer: moved in what no weight of it sees."""
    weights = observer("1931_2").weights(illuminant("D65"), WORKING_WAVELENGTHS_NM)
    wish = 0.1 * np.cos(np.linspace(0.0, 14.0, curve.size))
    return curve + wish - weights.T @ np.linalg.solve(weights @ weights.T, weights @ wish)


@pytest.fixture
def reviewed(scenes, write_matt, tmp_path):
    """Reviews a ball of one matt material: (folder's name, reflectance, renderer, changes of the scene) -> folder."""

    def run(name, curve=CURVE, renderer=None, **changes):
        write_matt(tmp_path / f"{name}.catalogue", "paint/red", curve)
        scene = replace(scenes.sphere_scene("paint/red", size=32, samples=2), **changes)
        catalogue = Catalogue.open(tmp_path / f"{name}.catalogue")
        out, options = tmp_path / name, {"illuminants": LIGHTS, "version": "test"}
        with renderer or software_session() as drawn_by:
            review(scene, catalogue, out, renderer=drawn_by, **options)
        return out

    return run


def compared(a: Path, b: Path):
    return compare(side_of(a, SeenSpectra()), side_of(b, SeenSpectra()), default_criteria())


def rotated(scene, degrees):
    """The scene's lights of one direction, turned about the vertical."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return tuple(
        replace(one, direction_to_light=turn @ one.direction_to_light) if isinstance(one, DirectionalLight) else one
        for one in scene.lights
    )


def test_repeats_are_identical(reviewed):
    found = compared(reviewed("a"), reviewed("b"))
    assert found.identical and found.valid and found.exit_code == 0


def test_gl_and_numpy_raise_no_alarm(reviewed, gl):
    from metamer.viewer.gl.backend import gl_session

    found = compared(reviewed("a"), reviewed("b", renderer=gl_session(gl)))
    assert found.exit_code == 0 and {row.state for row in found.rows} <= {"same", "identical"}
    assert all(row.layers["reference"].identical for row in found.rows)
    assert any("Renderer changed from" in note for note in found.notes)


def test_one_percent_of_one_band_is_found_below_every_limit(reviewed):
    curve = CURVE.copy()
    curve[np.searchsorted(WORKING_WAVELENGTHS_NM, 600.0)] *= 1.01
    found = compared(reviewed("a"), reviewed("b", curve))
    for row in found.rows:
        assert row.state == "changed" and row.tier == "pass", row
        assert row.layers["picture"].floor_mean < row.layers["picture"].mean < 0.1


def test_a_substituted_metamer_shows_under_the_other_light(reviewed):
    found = compared(reviewed("a"), reviewed("b", metamer_of(CURVE)))
    rows = {row.name.light: row for row in found.rows}
    assert rows["D65"].layers["picture"].mean < 0.1
    assert rows["A"].state == "changed" and rows["A"].layers["picture"].mean > 0.5
    assert rows["A"].tier == "fail" and rows["A"].notes[0].startswith("The reference changed")


def test_a_swapped_observer_is_refused(reviewed):
    with pytest.raises(ComparisonError, match="other observers"):
        compared(reviewed("a"), reviewed("b", observer=observer("1964_10")))


def test_a_light_turned_by_half_a_degree_is_found(reviewed, scenes):
    turned = rotated(scenes.sphere_scene("paint/red", size=32, samples=2), 0.5)
    found = compared(reviewed("a"), reviewed("b", lights=turned))
    for row in found.rows:
        assert row.state == "changed", row
        assert row.layers["picture"].mean > 10 * row.layers["picture"].floor_mean


def test_a_drift_of_a_fifth_is_found_as_the_material_s(reviewed):
    # dL* of 0.2 at L* near 66 is 0.9 % of Y.
    found = compared(reviewed("a"), reviewed("b", CURVE * 1.009))
    for row in found.rows:
        assert 0.1 < row.layers["picture"].mean < 0.3 and row.tier == "warn"
        assert row.notes[0].startswith("The reference changed")


def test_one_wrong_pixel_is_found(reviewed):
    a, b = reviewed("a"), reviewed("b")
    path = next((b / "pictures").glob("*.D65.exr"))
    header, channels = read_exr(path)
    said = {key: held for key, held in header.items() if isinstance(held, str) or key == "whiteXYZ"}
    channels["Y"] = channels["Y"].copy()
    channels["Y"][16, 17] *= 2.0
    write_exr(path, {key: held for key, held in said.items() if key not in ("type", "compression")}, channels)
    found = compared(a, b)
    rows = {row.name.light: row for row in found.rows}
    assert rows["D65"].layers["picture"].worst == (16, 17) and rows["D65"].tier == "fail"
    assert rows["D65"].notes[0].startswith("Only the picture moved") and rows["A"].state == "identical"


def test_catalogues_are_compared_on_the_sphere(write_matt, write_spectrum, tmp_path):
    for name, curve in (("a", CURVE), ("b", metamer_of(CURVE))):
        write_matt(tmp_path / name, "paint/red", curve)
        write_matt(tmp_path / name, "paint/grey", 0.3)
        write_spectrum(tmp_path / name, "cloth/blue", "transmittance", (0.5, 0.2, 0.1))
        write_spectrum(tmp_path / name, "lamp/warm")
    assert is_catalogue(tmp_path / "a")
    sides = [catalogue_side(tmp_path / name, SeenSpectra(LIGHTS)) for name in ("a", "b")]
    found = compare(*sides, default_criteria())
    states = {(row.name.material, row.name.light): row.state for row in found.rows}
    assert states.pop(("paint/red", "A")) == "changed"
    assert states.pop(("paint/red", "D65")) in ("changed", "same")
    assert set(states.values()) == {"identical"} and len(states) == 4
    assert any("lamp/warm" in line for line in found.before.chain)
