"""RGL measurements: the container, the warp against plain numerical integrals, and the BRDF against Mitsuba's."""

import struct

import numpy as np
import pytest
from metamer.materials.core.axes import Axis
from metamer.materials.core.directions import TAU, spherical
from metamer.materials.core.points import Points
from metamer.materials.factored.pack import FactoredBrdf, FactorPack
from metamer.materials.formats.rgl import MAGIC, read_rgl, recognises
from metamer.materials.intake.code_version import modules_of
from metamer.materials.intake.sources import read_sources
from metamer.materials.measured.bilinear_warp import BilinearWarp
from metamer.materials.measured.rgl import RglBrdf
from metamer.materials.measured.rgl_measurement import RglMeasurement
from metamer.materials.records.material import MaterialRecord
from metamer.materials.records.models import rebuild
from metamer.materials.records.record import read_record, write_record
from metamer.materials.records.source import Rejected
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.folding import Folding
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.palette import Palette
from metamer.spectral.upsampling import METHODS, xyz_from_rgb
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM

FILES = ("cc_iris_purple_gem_rgb", "colodur_napoli_4f_rgb", "satin_rosaline_rgb", "vch_golden_yellow_rgb")
TYPES = {"uint8": 1, "uint32": 5, "float16": 9, "float32": 10, "float64": 11}
HALF_TURN, QUARTER = np.linspace(-np.pi, 0.0, 5), np.linspace(-np.pi, -0.5 * np.pi, 4)


def written(path, fields):
    """A container of these arrays, as the format's description has it."""
    head, offset = MAGIC + bytes([1, 0]) + struct.pack("<I", len(fields)), 4096
    for name, values in fields.items():
        head += struct.pack("<H", len(name)) + name.encode()
        head += struct.pack("<HBQ", values.ndim, TYPES[values.dtype.name], offset)
        head += struct.pack(f"<{values.ndim}Q", *values.shape)
        offset += values.nbytes
    path.write_bytes(head.ljust(4096, b"\0") + b"".join(values.tobytes() for values in fields.values()))
    return path


def made_up(phi_i=(0.0,), wavelengths=None, seed=0, jacobian=1):
    """Fields of a small file whose numbers mean nothing but are all different."""
    random = np.random.default_rng(seed)
    phi_i, theta_i = np.asarray(phi_i, np.float32), np.radians([0, 30, 55, 75, 90]).astype(np.float32)
    lead = (len(phi_i), len(theta_i))
    isotropic = len(phi_i) == 1

    def positive(*shape):
        values = (0.2 + random.random(shape)).astype(np.float32)
        return np.repeat(values[..., :1, :], shape[-2], axis=-2) if isotropic and len(shape) == 2 else values

    fields = {
        "description": np.frombuffer("für tests".encode(), np.uint8),
        "phi_i": phi_i,
        "theta_i": theta_i,
        "ndf": positive(9, 12),
        "sigma": positive(7, 8),
        "vndf": positive(*lead, 9, 12),
        "luminance": positive(*lead, 6, 6),
        "jacobian": np.array([jacobian], np.uint8),
        "extra": np.arange(6, dtype=np.uint32).reshape(2, 3),
    }
    if wavelengths is None:
        return fields | {"rgb": positive(*lead, 3, 6, 6)}
    told = np.asarray(wavelengths, np.float32)
    return fields | {"wavelengths": told, "spectra": positive(*lead, len(told), 6, 6)}


def hemisphere(count, seed, least=0.0):
    random = np.random.default_rng(seed)
    return spherical(np.arccos(random.uniform(least, 1.0, count)), random.random(count) * TAU)


# Container


@pytest.mark.parametrize("phi_i", [(0.0,), HALF_TURN], ids=["isotropic", "anisotropic"])
@pytest.mark.parametrize("wavelengths", [None, [360.0, 500.0, 620.0, 1000.0]], ids=["rgb", "spectral"])
def test_every_field_is_kept(tmp_path, phi_i, wavelengths):
    fields = made_up(phi_i, wavelengths)
    path = written(tmp_path / "a.bin", fields)
    found = read_rgl(path)
    assert (
        recognises(path.with_suffix(".bin"), path.read_bytes()[:4096])
        and found.name == "a"
        and found.description == "für tests"
    )
    assert list(found.fields) == list(fields)
    for name, values in fields.items():
        assert found.fields[name].dtype == values.dtype, name
        np.testing.assert_array_equal(found.fields[name], values, err_msg=name)
    assert found.isotropic == (len(phi_i) == 1) and found.jacobian
    assert (found.wavelengths_nm is None) == (wavelengths is None)


@pytest.mark.parametrize("name", FILES)
def test_real_files(shared_data, name):
    found = read_rgl(shared_data / "brdf" / "rgl" / f"{name}.bsdf")
    assert found.isotropic and found.jacobian and found.wavelengths_nm is None
    assert found.fields["vndf"].shape == (1, 8, 128, 128) and found.values.shape == (1, 8, 3, 32, 32)
    assert found.description and {"valid", "version", "luminance"} <= set(found.fields)


def test_a_file_cut_anywhere_is_refused(tmp_path):
    whole = written(tmp_path / "whole.bsdf", made_up()).read_bytes()
    path = tmp_path / "cut.bsdf"
    for length in (0, 5, 12, 14, 18, 19, 40, 200, 4096, 5000, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(InputError) as error:
            read_rgl(path)
        assert str(path) in str(error.value), length


def test_a_shape_that_no_array_has_is_refused(tmp_path):
    """Its product is nothing, so that the file is long enough for it."""
    path = tmp_path / "empty.bsdf"
    for shape in ((0, 2**62), (0, *[5000] * 15)):
        name = b"ndf"
        field = struct.pack("<H", len(name)) + name + struct.pack("<HBQ", len(shape), 10, 0)
        path.write_bytes(MAGIC + struct.pack("<BBI", 1, 0, 1) + field + struct.pack(f"<{len(shape)}Q", *shape))
        with pytest.raises(InputError, match=r"(?s)empty\.bsdf: ndf.*no array has this shape"):
            read_rgl(path)


def test_mutated_headers_are_refused_or_read(tmp_path):
    whole = bytearray(written(tmp_path / "whole.bsdf", made_up()).read_bytes())
    random, path = np.random.default_rng(0), tmp_path / "mutated.bsdf"
    for _ in range(100):
        copy = bytearray(whole)
        for place in random.integers(0, 420, random.integers(1, 4)):
            copy[place] = random.integers(256)
        path.write_bytes(copy)
        try:
            RglBrdf(read_rgl(path)).eval(*(hemisphere(20, seed) for seed in (1, 2)))
        except InputError as error:
            assert "mutated" in str(error) or error.field == "phi_i"


def replaced(**fields):
    return lambda given: {**given, **fields}


def without(name):
    return lambda given: {key: value for key, value in given.items() if key != name}


@pytest.mark.parametrize(
    "change, words",
    [
        (without("sigma"), "sigma"),
        (without("rgb"), "rgb"),
        (replaced(theta_i=np.array([0, 1, 0.5, 1.2, 1.5], np.float32)), "ascend"),
        (replaced(theta_i=np.array([0, 0.5, 1], np.float32)), "another shape"),
        (replaced(theta_i=np.array([0, 30, 55, 75, 90], np.float32)), "radians"),
        (replaced(ndf=np.ones((1, 12), np.float32)), "another shape"),
        (replaced(ndf=np.full((9, 12), np.nan, np.float32)), "finite"),
        (replaced(sigma=np.full((7, 8), -1.0, np.float32)), "negative"),
        (replaced(vndf=np.zeros((1, 5, 9, 12), np.float32)), "nowhere positive"),
        (replaced(wavelengths=np.array([400.0, 500.0], np.float32)), "spectra"),
        (
            replaced(wavelengths=np.array([0.4, 0.5], np.float32), spectra=np.ones((1, 5, 2, 6, 6), np.float32)),
            "micrometres",
        ),
    ],
)
def test_fields_that_make_no_brdf_are_refused(tmp_path, change, words):
    path = written(tmp_path / "bad.bsdf", change(made_up()))
    with pytest.raises(InputError, match=words) as error:
        read_rgl(path)
    assert str(path) in str(error.value)


def test_another_kind_of_file_is_refused(tmp_path):
    path = tmp_path / "text.bsdf"
    path.write_text("theta_i phi_i\n")
    assert not recognises(path.with_suffix(".bin"), path.read_bytes()[:4096])
    with pytest.raises(InputError, match="tensor_file"):
        read_rgl(path)
    with pytest.raises(InputError, match="no such file"):
        read_rgl(tmp_path / "none.bsdf")


# Warp


def test_warp_is_the_integral_of_its_density():
    random = np.random.default_rng(4)
    density = random.random((2, 6, 9))
    density[0, 2] = 0.0  # a row without light
    density[1, :, 3] = 0.0
    share, rows, columns = np.array([0.3, 0.7]), np.linspace(0, 1, 6), np.linspace(0, 1, 9)
    x, y = random.random((2, 40))
    slices = [(np.full(40, which), np.full(40, share[which])) for which in (0, 1)]
    found_x, found_y = BilinearWarp(density).uniform(x, y, slices)
    whole = np.trapezoid(np.trapezoid(density, columns), rows)
    mixture = np.tensordot(share, density / whole[:, None, None], 1)

    def integral(values, nodes, end):
        """Integrate from 0 to `end` what is linear between nodes."""
        places = np.append(nodes[nodes < end], end)
        return np.trapezoid(np.interp(places, nodes, values), places)

    marginal = np.trapezoid(mixture, columns)
    for k in range(40):
        row = np.array([np.interp(y[k], rows, column) for column in mixture.T])
        assert found_x[k] == pytest.approx(integral(row, columns, x[k]) / integral(row, columns, 1.0), abs=1e-13)
        assert found_y[k] == pytest.approx(integral(marginal, rows, y[k]), abs=1e-13)


def test_a_uniform_density_is_left_alone():
    random = np.random.default_rng(1)
    x, y = random.random((2, 100))
    slices = [(np.zeros(100, dtype=int), np.ones(100))]
    found = BilinearWarp(np.full((1, 5, 4), 7.0)).uniform(x, y, slices)
    np.testing.assert_allclose(found, (x, y), atol=1e-14)


# BRDF


# Mitsuba never sets the symmetry of an isotropic file, and takes it from what lay there before: twins are never freed.
_TWINS = []


def mitsuba_values(variant, path, wi, wo, wavelengths=()):
    """f_r cos(theta_o) of Mitsuba's `measured`, in RGB or at (four) wavelengths."""
    mitsuba = pytest.importorskip("mitsuba", reason="the optional extra: pip install 'metamer-colour[mitsuba]'")
    before = mitsuba.variant()
    mitsuba.set_variant(variant)
    try:
        twin = mitsuba.load_dict({"type": "measured", "filename": str(path)})
        _TWINS.append(twin)
        interaction, context = mitsuba.SurfaceInteraction3f(), mitsuba.BSDFContext()
        if len(wavelengths):
            interaction.wavelengths = [float(wavelength) for wavelength in wavelengths]
        out = []
        for light, viewer in zip(wi, wo, strict=True):
            interaction.wi = mitsuba.Vector3f(*light)
            out.append(np.array(twin.eval(context, interaction, mitsuba.Vector3f(*viewer))).ravel())
        return np.array(out)
    finally:
        if before:
            mitsuba.set_variant(before)


def differences(ours, theirs):
    """Relative, where Mitsuba has not exactly nothing."""
    some = theirs != 0
    np.testing.assert_array_equal(ours[~some], 0.0)
    return np.abs(ours[some] / theirs[some] - 1.0)


@pytest.mark.parametrize("name", FILES)
def test_mitsuba_agrees_on_real_files(shared_data, name):
    path = shared_data / "brdf" / "rgl" / f"{name}.bsdf"
    wi, wo = hemisphere(10_000, 1), hemisphere(10_000, 2)
    theirs = mitsuba_values("scalar_rgb", path, wi, wo)
    ours = RglBrdf(read_rgl(path)).eval_measured(wi, wo) * wo[:, 2:]
    apart = differences(ours, theirs)
    assert np.median(apart) < 1e-5, np.median(apart)
    assert np.quantile(apart, 0.99) < 1e-3, np.quantile(apart, 0.99)
    np.testing.assert_array_equal(ours < 0, theirs < 0)


@pytest.mark.parametrize("phi_i", [(0.0,), np.linspace(-np.pi, np.pi, 9), HALF_TURN, QUARTER])
@pytest.mark.parametrize("jacobian", [0, 1])
def test_mitsuba_agrees_on_spectra_and_anisotropy(tmp_path, phi_i, jacobian):
    path = written(tmp_path / "made.bsdf", made_up(phi_i, [360.0, 470.0, 540.0, 620.0, 1000.0], jacobian=jacobian))
    wavelengths = (400.0, 520.0, 540.0, 655.0)
    wi, wo = hemisphere(400, 3, 0.01), hemisphere(400, 4, 0.01)
    theirs = mitsuba_values("scalar_spectral", path, wi, wo, wavelengths)
    columns = np.searchsorted(WORKING_WAVELENGTHS_NM, wavelengths)
    ours = RglBrdf(read_rgl(path)).eval(wi, wo)[:, columns] * wo[:, 2:]
    apart = differences(ours, theirs)
    assert np.median(apart) < 1e-5 and np.quantile(apart, 0.99) < 1e-3, (np.median(apart), apart.max())


BRDFS = {
    "isotropic rgb": made_up(),
    "isotropic spectral": made_up(wavelengths=[380.0, 550.0, 780.0]),
    "anisotropic rgb": made_up(np.linspace(-np.pi, np.pi, 9)),
    "half turn": made_up(HALF_TURN, [400.0, 700.0]),
    "two mirrors": made_up(QUARTER),
}
every_brdf = pytest.mark.parametrize("fields", BRDFS.values(), ids=BRDFS)


def test_a_file_finer_than_the_working_wavelengths_is_evaluated_at_its_own():
    """The data base's spectra stand 3.3 nm apart; those that no observer sees cost nothing."""
    told = np.linspace(290.0, 1000.0, 216)
    brdf = RglBrdf(RglMeasurement("made", made_up(wavelengths=told)))
    seen = brdf.wavelengths_nm
    assert 335 < seen[0] < 360 and 830 < seen[-1] < 855 and len(seen) < 160
    wi, wo = hemisphere(50, 5), hemisphere(50, 6)
    columns = np.isin(told.astype(np.float32).astype(float), seen)
    np.testing.assert_allclose(brdf.eval(wi, wo), brdf.eval_measured(wi, wo)[:, columns], rtol=1e-9)
    assert any("finer than 5 nm" in note for note in brdf.notes)


@every_brdf
def test_horizon_grazing_and_broadcasting(fields):
    brdf = RglBrdf(RglMeasurement("made", fields))
    steep = np.array([[1.0, 0.0, 6e-17], [0.0, -1.0, 1e-300], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    values = brdf.eval(steep[:, None], steep)
    assert values.shape == (5, 5, 81) and np.isfinite(values).all() and values.min() >= 0
    assert not values[2:4].any() and not values[:, 2:4].any() and values[4, 4].all()
    wi, wo = hemisphere(2000, 5), hemisphere(2000, 6)
    values = brdf.eval(wi, wo)
    assert np.isfinite(values).all() and values.min() >= 0


@every_brdf
def test_symmetries_that_the_file_states(fields):
    brdf = RglBrdf(RglMeasurement("made", fields))
    wi, wo = hemisphere(500, 7), hemisphere(500, 8)
    turned = [np.stack([-w[:, 1], w[:, 0], w[:, 2]], axis=-1) for w in (wi, wo)]
    half = [w * [-1, -1, 1] for w in (wi, wo)]
    mirrored = [w * [-1, 1, 1] for w in (wi, wo)]
    first, phi_i = brdf.eval(wi, wo), fields["phi_i"]
    assert brdf.isotropic == (len(phi_i) == 1) == np.allclose(brdf.eval(*turned), first, rtol=1e-6)
    assert np.allclose(brdf.eval(*half), first, rtol=1e-6) == (len(phi_i) in (1, 4, 5))
    if len(phi_i) == 4:
        np.testing.assert_allclose(brdf.eval(*mirrored), first, rtol=1e-6)


@every_brdf
def test_parameters_rebuild_it_bit_for_bit(fields):
    brdf = RglBrdf(RglMeasurement("made", fields), "smits")
    again = RglBrdf.from_parameters(brdf.parameters())
    wi, wo = hemisphere(100, 9), hemisphere(100, 10)
    assert again.method == "smits" and list(again.measurement.fields) == list(fields)
    np.testing.assert_array_equal(again.eval(wi, wo), brdf.eval(wi, wo))


@every_brdf
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("below", [0.0, 0.6])
def test_colours_are_those_of_its_spectra(fields, method, below):
    """Under several lights at once, also outside of sRGB, one set of lights after the other."""
    name = "rgb" if "rgb" in fields else "spectra"
    brdf = RglBrdf(RglMeasurement("made", fields | {name: fields[name] - np.float32(below)}), method)
    points = Points(hemisphere(300, 13), hemisphere(300, 14))
    for lights in (("D65", "A"), ("FL11",), ("D65", "A")):
        folding = Folding(observer("1931_2"), tuple(map(illuminant, lights)))
        found, weights = brdf.xyz(points, folding), folding.weights(brdf.wavelengths_nm)
        expected = brdf.at(points) @ weights
        assert found.shape == (300, 3 * len(lights))
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_colours_outside_srgb_are_kept(method):
    fields = made_up()
    fields["rgb"] = fields["rgb"] - np.float32(0.6)
    brdf = RglBrdf(RglMeasurement("made", fields), method)
    wi, wo = hemisphere(500, 11), hemisphere(500, 12)
    rgb = brdf.eval_measured(wi, wo)
    assert (rgb < 0).mean() > 0.05
    xyz = brdf.eval(wi, wo) @ observer("1931_2").weights(illuminant("D65"), WORKING_WAVELENGTHS_NM).T
    scale = np.abs(rgb).max(axis=1, keepdims=True)
    # Published spectra meet their colours to a few thousandths; Smits' are coarser.
    np.testing.assert_allclose(
        np.linalg.solve(xyz_from_rgb(), xyz.T).T / scale, rgb / scale, atol=0.12 if method == "smits" else 5e-3
    )
    assert any("negative" in note for note in brdf.notes)
    assert not any("negative" in note for note in RglBrdf(RglMeasurement("made", made_up())).notes)


def test_unknown_symmetry_and_method_are_refused():
    with pytest.raises(InputError, match="symmetry"):
        RglBrdf(RglMeasurement("made", made_up(np.linspace(0.0, 2.0, 5))))
    with pytest.raises(UnknownNameError):
        RglBrdf(RglMeasurement("made", made_up()), "guess")


# Catalogue


def test_import_knows_it_by_content_and_rebuilds_it(tmp_path):
    for name, fields in {
        "film.dat": made_up(),
        "paint.bsdf": made_up(wavelengths=[400.0, 700.0]),
        "bad.bsdf": without("vndf")(made_up()),
    }.items():
        written(tmp_path / name, fields)
    (film,), (paint,), (bad,) = (read_sources(tmp_path / name) for name in ("film.dat", "paint.bsdf", "bad.bsdf"))
    assert isinstance(bad, Rejected) and "vndf" in str(bad.reason)
    assert film.provenance.kind == "uplifted(mallett-yuksel)" and paint.provenance.kind == "measured"
    assert "für tests" in film.provenance.source and "2 wavelengths" in paint.provenance.geometry
    wi, wo = hemisphere(50, 13), hemisphere(50, 14)
    for found, path in ((film, "film.dat"), (paint, "paint.bsdf")):
        assert (found.id, found.model) == (f"measured/{found.file.stem}", "rgl")
        again = rebuild(found.model, found.parameters)
        np.testing.assert_array_equal(again.eval(wi, wo), RglBrdf(read_rgl(tmp_path / path)).eval(wi, wo))


def test_record_keeps_every_field_of_the_file(tmp_path):
    (source,) = read_sources(written(tmp_path / "film.bsdf", made_up()))
    axes = tuple(Axis(name, 2, 0.5 * np.pi) for name in ("theta_h", "theta_d", "phi_d"))
    pack = FactorPack("hd", axes, (np.ones((2, 1)),) * 3, Palette.of(np.ones((1, 81))))
    told = (source.id, source.family, source.model, source.parameters, source.provenance)
    write_record(MaterialRecord(*told, FactoredBrdf((pack,))), tmp_path / "film.h5")
    brdf = read_record(tmp_path / "film.h5").brdf()
    assert isinstance(brdf, RglBrdf)
    for name, values in made_up().items():
        found = brdf.measurement.fields[name]
        assert found.dtype == values.dtype, name
        np.testing.assert_array_equal(found, values, err_msg=name)


def test_import_knows_what_code_its_fit_depends_on():
    assert {"materials/measured/rgl", "materials/measured/bilinear_warp"} <= set(modules_of("rgl"))
