"""Sets of maps whose base colour is a spectral picture: measured reflectances stay as they are, beside other maps."""

import warnings

import numpy as np
import OpenEXR
import pytest
from metamer.materials.core.points import Points
from metamer.materials.core.protocol import sphere_protocol
from metamer.materials.export.files import export
from metamer.materials.formats import maps, texture_exr
from metamer.materials.formats.registry import format_for
from metamer.materials.records.material import MaterialRecord
from metamer.materials.records.models import rebuild
from metamer.runtime.errors import InputError
from metamer.spectral.formats.import_options import NO_ANSWER, ImportOptions
from PIL import Image

NM = np.arange(400.0, 701.0, 20.0)
RNG = np.random.default_rng(8)
VALUES = (RNG.uniform(0.2, 0.8, (4, 6, 1)) * np.linspace(0.3, 1.0, len(NM)) ** RNG.uniform(0, 2, (4, 6, 1))).astype(
    np.float32
)
ROUGH = RNG.integers(80, 250, (4, 6)).astype(np.uint8)
UP = np.array([[0.0, 0.0, 1.0]])


def spectral(path, values=VALUES, kind="T", **more):
    channels = {f"{kind}.{nm:.0f},0nm": np.ascontiguousarray(values[..., at]) for at, nm in enumerate(NM)} | more
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, "EV": 1.5}
        OpenEXR.File(header, channels).write(str(path))
    return path


def beside(folder, role="roughness", values=ROUGH):
    Image.fromarray(values).save(folder / f"oak_{role}.png")


def read(path, answer=NO_ANSWER):
    (found,) = maps.read_sources(path, "mallett-yuksel", answer)
    return found


def test_spectra_and_roughness_of_each_texel(tmp_path):
    path = spectral(tmp_path / "oak_albedo.exr", R=VALUES[..., 0])
    beside(tmp_path)
    assert format_for(path) is maps and maps.companions(path) == (tmp_path / "oak_roughness.png",)
    oak = read(path)
    assert (oak.id, oak.model, oak.provenance.kind) == ("maps/oak", "maps", "analytic")
    assert "measured: 16 wavelengths" in oak.provenance.notes and "mallett" not in oak.provenance.notes
    assert "diffuse" not in oak.provenance.notes and "preview" in oak.provenance.notes
    assert oak.original["exr.EV"] == "1.5" and not any(name.startswith("uplift") for name in oak.original)
    surface = rebuild(oak.model, oak.parameters)
    np.testing.assert_array_equal(surface.base.values, VALUES)
    np.testing.assert_array_equal(surface.wavelengths_nm, NM)
    texels = surface.texels(*np.divmod(np.arange(24), 6))
    np.testing.assert_array_equal(texels.body, VALUES.reshape(24, -1))
    np.testing.assert_allclose(texels.facets, 0.04)
    np.testing.assert_allclose(texels.spread[:, 0], (ROUGH.ravel() / 255.0) ** 4)
    # At the middle of a texel, at the normal: body and facets.
    at = surface.at(Points(UP, UP, np.array([[2.5 / 6, 1 - 1.5 / 4]])))[0]
    alpha = (ROUGH[1, 2] / 255.0) ** 2
    np.testing.assert_allclose(at, 0.96 * VALUES[1, 2] / np.pi + 0.04 / (4 * np.pi * alpha**2), rtol=1e-6)


def test_what_is_drawn_is_the_original_within_the_budget(tmp_path):
    path = spectral(tmp_path / "oak_albedo.exr")
    beside(tmp_path)
    surface = rebuild("maps", read(path).parameters)
    sphere, lights = sphere_protocol(32, False), ("D65", "FL11")
    form = surface.own_form(0.5)
    for truth, drawn in zip(sphere.references(surface, lights), sphere.samples(form, lights), strict=True):
        assert np.percentile(sphere.differences(truth, drawn), 99) < 0.1


def test_without_facets_the_bumps_are_of_a_matt_surface(tmp_path):
    path = spectral(tmp_path / "oak_albedo.exr")
    leaning = np.broadcast_to(np.array([160, 127, 240], np.uint8), (4, 6, 3))
    beside(tmp_path, "nor_gl", leaning)
    oak = read(path)
    surface = rebuild(oak.model, oak.parameters)
    assert "perfectly diffuse" in oak.provenance.notes and surface.normal is not None
    assert not surface.texels(np.zeros(1, int), np.zeros(1, int)).facets.any()


def test_the_mean_is_a_spectrum_too(tmp_path):
    path = spectral(tmp_path / "oak_albedo.exr")
    beside(tmp_path)
    oak = read(path, ImportOptions(maps="mean"))
    mean = rebuild(oak.model, oak.parameters)
    assert oak.model == "metallic_roughness" and "mean of the maps" in oak.provenance.notes
    # Through facets that reflect 4 %.
    body = VALUES.mean(axis=(0, 1), dtype=float)
    np.testing.assert_allclose(mean.diffuse.samples, body, rtol=1e-6)


def test_alone_it_stays_a_texture(tmp_path):
    path = spectral(tmp_path / "oak_albedo.exr", RNG.uniform(size=(12, 9, len(NM))).astype(np.float32))
    assert format_for(path) is texture_exr
    (found,) = texture_exr.read_sources(path, "mallett-yuksel")
    assert found.model == "spectral_texture"


@pytest.mark.parametrize(
    "kind, scale, role, words",
    [("S0", 1.0, "roughness", "not one base"), ("T", 3.0, "roughness", "no base"), ("T", 1.0, "color", "two maps")],
)
def test_what_is_no_base_colour_is_refused(tmp_path, kind, scale, role, words):
    path = spectral(tmp_path / "oak_albedo.exr", VALUES * np.float32(scale), kind)
    beside(tmp_path, role, np.stack([ROUGH] * 3, axis=-1))
    with pytest.raises(InputError, match=words) as refused:
        read(path)
    assert str(path.name) in str(refused.value) and refused.value.hint


def test_maps_of_another_size_are_refused(tmp_path):
    path = spectral(tmp_path / "oak_albedo.exr")
    beside(tmp_path, "roughness", ROUGH[:2])
    with pytest.raises(InputError, match="different sizes"):
        read(path)


def test_noise_below_black_stays_and_is_counted(tmp_path):
    values = VALUES.copy()
    values[0, 0, 3] = -0.01
    path = spectral(tmp_path / "oak_albedo.exr", values)
    beside(tmp_path)
    oak = read(path)
    assert oak.model == "maps" and "1 of 384 values are negative" in oak.provenance.notes


def test_other_programs_get_what_d65_shows_of_it(tmp_path):
    path = spectral(tmp_path / "oak_albedo.exr")
    beside(tmp_path)
    oak = read(path)
    record = MaterialRecord(oak.id, oak.family, oak.model, oak.parameters, oak.provenance, None, "", oak.original)
    (done,) = export([record], "gltf", tmp_path / "oak.glb")
    assert "reduced to linear sRGB" in " ".join(done.notes) and "--uplift" not in " ".join(done.notes)
