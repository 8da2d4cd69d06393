"""Changes between two materials, against values worked out by hand."""

import numpy as np
import pytest
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.catalogue.compare import compare_catalogues, compare_records
from metamer.materials.core.protocol import measured, sphere_protocol
from metamer.materials.records.record import read_record
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.bispectral import Bispectral
from metamer.spectral.folding import Folding
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM


@pytest.fixture
def pair(tmp_path):
    return tmp_path / "a", tmp_path / "b"


def test_two_greys_differ_in_lightness_alone(pair, write_matt):
    """ΔE94 of greys is that of L*: 116 (cbrt(0.6 c) - cbrt(0.5 c)) at the cosine c of each sample, under any light."""
    a, b = (read_record(write_matt(folder, "x/g", value)) for folder, value in zip(pair, (0.5, 0.6), strict=True))
    cosine = sphere_protocol(96).wi[:, 2]
    lightness = [
        116 * np.where(y > (24 / 116) ** 3, np.cbrt(y), y * 841 / 108 + 16 / 116) for y in (0.5 * cosine, 0.6 * cosine)
    ]
    expected = lightness[1] - lightness[0]
    for of in ("packs", "original"):
        found = compare_records(a, b, illuminants=("D65", "A"), of=of)
        assert found.status == "changed" and [one.light for one in found.lights] == ["D65", "A"]
        for one in found.lights:
            np.testing.assert_allclose(
                [one.mean, one.p95, one.p99, one.maximum],
                [expected.mean(), *np.percentile(expected, [95, 99]), expected.max()],
                atol=2e-3,
            )


def test_first_is_the_reference(pair, write_matt):
    red = np.linspace(0.02, 0.9, 81)
    a, b = (read_record(write_matt(f, "x/r", value)) for f, value in zip(pair, (red, 0.5), strict=True))
    there, back = (compare_records(*sides).worst.p99 for sides in ((a, b), (b, a)))
    assert back > 1.5 * there


def test_packs_and_original_are_told_apart(pair, write_matt):
    """The same data under other packs: what was measured has not changed, what pictures show has."""
    a = read_record(write_matt(pair[0], "x/g", 0.5))
    b = read_record(write_matt(pair[1], "x/g", 0.5, shown=np.full(81, 0.55)))
    assert compare_records(a, b, of="original").worst.maximum == 0.0
    assert compare_records(a, b, of="packs").worst.p99 > 1.0


def test_catalogues(pair, write_matt, write_spectrum):
    for folder, changed in zip(pair, (0.5, 0.52), strict=True):
        write_matt(folder, "x/same", 0.3)
        write_matt(folder, "x/changed", changed)
        write_spectrum(folder, "l/same")
    write_matt(pair[0], "x/removed")
    write_matt(pair[1], "x/added")
    write_matt(pair[0], "x/other")
    write_spectrum(pair[1], "x/other", "transmittance")
    write_matt(pair[0], "x/broken").write_bytes(b"")
    write_matt(pair[1], "x/broken")
    found = compare_catalogues(*map(Catalogue.open, pair), jobs=1)
    assert {one.id: one.status for one in found.differences} == {
        "l/same": "same",
        "x/added": "added",
        "x/broken": "unusable",
        "x/changed": "changed",
        "x/other": "not comparable",
        "x/removed": "removed",
        "x/same": "same",
    }
    assert found.count("same") == 2 and 0.5 < found.largest < 3.0
    words = {one.id: one.words for one in found.differences}
    assert words["x/other"] == "reflectance -> transmittance" and "broken.h5" in words["x/broken"]


def test_identical_files_are_not_opened(pair, write_matt):
    """Heads suffice: content that could not even be read makes no difference."""
    for folder in pair:
        path = write_matt(folder, "x/g")
        path.write_bytes(path.read_bytes()[:4096])
    found = compare_catalogues(*map(Catalogue.open, pair), jobs=1)
    assert [one.status for one in found.differences] == ["same"]


@pytest.mark.slow
def test_several_processes_find_the_same(pair, write_matt):
    for index in range(9):
        for folder, more in zip(pair, (0.0, 0.01 * index), strict=True):
            write_matt(folder, f"x/g{index}", 0.3 + more)
    found = [compare_catalogues(*map(Catalogue.open, pair), jobs=jobs).differences for jobs in (1, 2)]
    assert found[0] == found[1]


def test_spectra_without_a_surface(pair, write_spectrum):
    a, b = (
        read_record(write_spectrum(folder, "x/s", "radiance_factor", values))
        for folder, values in zip(pair, ((0.5, 0.5), (0.6, 0.6)), strict=True)
    )
    found = compare_records(a, b)
    expected = 116 * (np.cbrt(0.6) - np.cbrt(0.5))
    assert found.worst.p99 == found.worst.mean == pytest.approx(expected, abs=1e-3) and len(found.lights) == 3


def test_lights_are_compared_as_lights(pair, write_spectrum):
    """Power alone is no difference of colour."""
    a, dim, warm = (
        read_record(write_spectrum(pair[0], f"x/{name}", "emission", values))
        for name, values in (("a", (0.2, 0.4, 0.2)), ("dim", (0.1, 0.2, 0.1)), ("warm", (0.1, 0.4, 0.3)))
    )
    assert compare_records(a, dim).worst.maximum < 1e-9
    assert compare_records(a, warm).worst.p99 > 5.0
    dark = read_record(write_spectrum(pair[0], "x/dark", "emission", (0.0, 0.0)))
    with pytest.raises(InputError, match="a light without power"):
        compare_records(a, dark)


def test_other_model_is_said(pair, write_matt):
    parameters = {"wavelengths_nm": NM, "reflectance": np.full(81, 0.5), "sigma": 0.3}
    a, b = (
        read_record(write_matt(pair[0], "x/g")),
        read_record(write_matt(pair[1], "x/g", model="oren_nayar", parameters=parameters)),
    )
    assert compare_records(a, b).words == "model lambert -> oren_nayar"


def test_unknown_light_is_refused_at_once(pair, write_matt):
    for folder in pair:
        write_matt(folder, "x/g")
    with pytest.raises(UnknownNameError, match="D65"):
        compare_catalogues(*map(Catalogue.open, pair), illuminants=("D66",))


def test_fluorescent_original_and_packs_agree(tmp_path, write_matt):
    """The packs of a fluorescent surface are exact, under lights that excite it differently."""
    matrix = np.diag(np.full(40, 0.4))
    matrix[20:28, :4] += 0.05
    surface = FluorescentLambert(Bispectral(np.arange(380.0, 780.0, 10.0), np.arange(380.0, 780.0, 10.0), matrix))
    fast = measured(surface.own_form(), surface, 32)
    changes = {"model": surface.NAME, "parameters": surface.parameters(), "fast": fast}
    record = read_record(write_matt(tmp_path, "x/f", **changes))
    sphere, eye = sphere_protocol(32), observer("1931_2")
    lights = [illuminant("D65"), illuminant("A")]
    folding = Folding(eye, lights, np.pi)
    fast, slow = sphere.fast_xyz(record.fast, folding), sphere.original_xyz(record.brdf(), folding)
    np.testing.assert_allclose(fast, slow, atol=2e-3)
    assert np.abs(fast[0] - fast[1]).max() > 0.05
