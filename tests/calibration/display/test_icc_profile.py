"""ICC profiles of displays: codes against LittleCMS, and files that cannot be used."""

import io

import numpy as np
import PyOpenColorIO as ocio
import pytest
from icc_profiles import COLUMNS, FORMS, curve, matrix_profile, new_tables, number, old_tables, profile, xyz
from metamer.calibration.display.claims import claim_named
from metamer.calibration.display.icc import D50_XYZ
from metamer.calibration.display.icc_profile import read_display_profile
from metamer.runtime.errors import InputError
from metamer.spectral.adaptation import adaptation_matrix
from PIL import Image, ImageCms

# LittleCMS tabulates what it joins; left out, it goes from element to element with 16 bits.
_AS_IT_IS = ImageCms.Flags.NOOPTIMIZE


def run(transform, values: np.ndarray) -> np.ndarray:
    """Values after an OCIO transform, float32."""
    depth, values = ocio.BIT_DEPTH_F32, np.array(values, dtype=np.float32, order="C")
    processor = ocio.Config.CreateRaw().getProcessor(transform)
    processor.getOptimizedCPUProcessor(depth, depth, ocio.OPTIMIZATION_LOSSLESS).applyRGB(values)
    return values


@pytest.fixture(scope="module")
def grid() -> np.ndarray:
    """(4913,3) codes of 8 bits."""
    steps = np.round(np.linspace(0.0, 255.0, 17)).astype(np.uint8)
    return np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)


@pytest.fixture(scope="module")
def srgb(tmp_path_factory) -> tuple[ImageCms.ImageCmsProfile, object]:
    """LittleCMS's own profile of sRGB, and how it is read here."""
    made = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB"))
    return made, read_display_profile("sRGB", made.tobytes())


def quantise(rgb: np.ndarray) -> np.ndarray:
    """Codes of 8 bits."""
    return np.rint(np.clip(rgb.astype(float), 0.0, 1.0) * 255.0)


def by_littlecms(grid, source, target) -> np.ndarray:
    how = ImageCms.Intent.RELATIVE_COLORIMETRIC
    transform = ImageCms.ImageCmsTransform(source, target, "RGB", "RGB", intent=how, flags=_AS_IT_IS)
    return np.asarray(transform.apply(Image.fromarray(grid.reshape(17, -1, 3)))).reshape(-1, 3).astype(float)


@pytest.mark.parametrize("form", FORMS)
def test_codes_are_those_of_littlecms(form, grid, srgb):
    """Within one code of 8 bits each way, sRGB to the display and the display to sRGB."""
    read = read_display_profile(form, FORMS[form])
    theirs = ImageCms.ImageCmsProfile(io.BytesIO(FORMS[form]))
    assert read.name == "Desk"
    codes = grid / 255.0
    sent = run(read.from_xyz_d65, run(srgb[1].to_xyz_d65, codes))
    expected = by_littlecms(grid, srgb[0], theirs)
    assert np.abs(quantise(sent) - expected).max() <= 1.0
    assert np.abs(quantise(sent) - expected).mean() <= 0.02
    assert np.abs(expected - grid).max() > 20.0, "a profile that changes nothing proves nothing"
    shown = run(srgb[1].from_xyz_d65, run(read.to_xyz_d65, codes))
    assert np.abs(quantise(shown) - by_littlecms(grid, theirs, srgb[0])).max() <= 1.0


def test_an_optimised_link_of_littlecms_is_near(grid, srgb):
    """Programs let LittleCMS join the two into a table of its own, which is off by a code more."""
    data = FORMS["matrix and a parametric curve, version 4"]
    how = ImageCms.Intent.RELATIVE_COLORIMETRIC
    theirs = ImageCms.ImageCmsProfile(io.BytesIO(data))
    transform = ImageCms.ImageCmsTransform(srgb[0], theirs, "RGB", "RGB", intent=how)
    expected = np.asarray(transform.apply(Image.fromarray(grid.reshape(17, -1, 3)))).reshape(-1, 3).astype(float)
    sent = run(read_display_profile("", data).from_xyz_d65, run(srgb[1].to_xyz_d65, grid / 255.0))
    assert np.abs(quantise(sent) - expected).max() <= 2.0


def test_codes_go_on_beyond_the_range_and_come_back():
    """Colours that a matrix with curves cannot show are still told from those that it can."""
    read = read_display_profile("", FORMS["matrix and a parametric curve, version 4"])
    assert not read.has_limits and read_display_profile("", FORMS["tables of 16 bits to Lab, version 2"]).has_limits
    white = np.array([[0.3127 / 0.3290, 1.0, 0.3583 / 0.3290]])
    np.testing.assert_allclose(run(read.from_xyz_d65, white), 1.0, atol=1e-4)
    assert (run(read.from_xyz_d65, 1.5 * white) > 1.1).all()
    assert run(read.from_xyz_d65, np.array([[0.1, 0.9, 0.1]])).min() < -0.1
    codes = np.random.default_rng(0).uniform(size=(500, 3))
    np.testing.assert_allclose(run(read.from_xyz_d65, run(read.to_xyz_d65, codes)), codes, atol=1e-3)


def test_black_is_code_nothing_where_the_first_codes_give_no_light():
    """A curve that begins flat: no light is asked for by code 0, a little by the codes that give it."""
    flat = np.maximum(np.linspace(-0.05, 1.0, 256), 0.0)
    tags = {channel + b"TRC": curve(flat) for channel in (b"r", b"g", b"b")}
    columns = {b"rXYZ": (0.43, 0.22, 0.01), b"gXYZ": (0.39, 0.72, 0.1), b"bXYZ": (0.14, 0.06, 0.71)}
    read = read_display_profile("", profile({**tags, **{name: xyz(one) for name, one in columns.items()}}))
    black, dark = run(read.from_xyz_d65, np.array([[0.0, 0.0, 0.0], [1e-3, 1e-3, 1e-3]]))
    assert (black == 0.0).all() and (dark > 0.04).all()


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (profile({}, kind=b"prtr", space=b"CMYK", pcs=b"Lab "), ("not a profile of a display", "a printer profile")),
        (profile({}, kind=b"scnr"), ("a scanner or camera profile",)),
        (profile({}, kind=b"link"), ("a device link",)),
        (profile({}, space=b"GRAY"), ("colour space", "GRAY", "RGB")),
        (profile({}), ("lacks a tag", "rXYZ", "bTRC", "B2A0")),
        (profile({b"A2B0": b"mft2" + bytes(60)}, pcs=b"Lab "), ("one direction alone", "no B2A0")),
        (profile({b"A2B0": b"what" + bytes(60), b"B2A0": b"what" + bytes(60)}, pcs=b"Lab "), ("kind of table", "what")),
        (matrix_profile(pcs=b"Lab "), ("matrix and curves lead to XYZ",)),
        (matrix_profile(version=5), ("version", "5.")),
        (b"P6 not a profile" * 20, ("not an ICC profile", "acsp")),
        (b"", ("not an ICC profile",)),
    ],
)
def test_profiles_that_are_of_something_else(data, words, tmp_path):
    path = tmp_path / "some.icc"
    path.write_bytes(data)
    with pytest.raises(InputError) as refused:
        read_display_profile(path)
    assert refused.value.file == path
    for word in words:
        assert word in str(refused.value)


@pytest.mark.parametrize("form", FORMS)
def test_profiles_that_are_cut_short(form):
    """At every length: the header says how long it is; and where it lies, each element is missed."""
    data = FORMS[form]
    for length in (*range(0, 400, 7), *np.linspace(400, len(data) - 1, 40).astype(int)):
        with pytest.raises(InputError, match=r"cut short|not an ICC profile"):
            read_display_profile("cut.icc", data[:length])


@pytest.mark.parametrize("form", FORMS)
def test_damaged_profiles_are_refused_or_read_and_nothing_else(form):
    """Bytes put in at random: an InputError, or numbers."""
    rng = np.random.default_rng(5)
    for _ in range(60):
        data = bytearray(FORMS[form])
        for at in rng.integers(0, min(len(data), 700), 3):
            data[at] = rng.integers(256)
        try:
            read = read_display_profile("damaged.icc", bytes(data))
        except InputError as refused:
            assert "damaged.icc" in str(refused)
            continue
        assert np.isfinite(run(read.to_xyz_d65, np.full((1, 3), 0.5))).all()


def test_a_cube_larger_than_opencolorio_has_is_refused():
    data = bytearray(FORMS["tables of 16 bits to Lab, version 2"])
    data[data.index(b"mft2") + 10] = 200
    with pytest.raises(InputError, match="OpenColorIO does not have"):
        read_display_profile("", bytes(data))


def test_a_tone_curve_that_goes_back_is_refused():
    back = np.linspace(0.0, 1.0, 64)
    back[40] = 0.2
    tags = {channel + b"TRC": curve(back) for channel in (b"r", b"g", b"b")}
    columns = {b"rXYZ": (0.43, 0.22, 0.01), b"gXYZ": (0.39, 0.72, 0.1), b"bXYZ": (0.14, 0.06, 0.71)}
    with pytest.raises(InputError, match="rTRC: a tone curve that goes back"):
        read_display_profile("", profile({**tags, **{name: xyz(one) for name, one in columns.items()}}))


def test_a_name_in_either_form_and_curves_of_the_video_card():
    assert read_display_profile("", old_tables(name="Büro links", version=4)).name == "Büro links"
    assert read_display_profile("", new_tables(name="Desk 2")).name == "Desk 2"
    loads = profile({b"vcgt": b"vcgt" + bytes(20)}, name="")
    with pytest.raises(InputError, match="lacks a tag"):
        read_display_profile("", loads)
    tags = {channel + b"TRC": curve(gamma=2.0) for channel in (b"r", b"g", b"b")}
    columns = {b"rXYZ": (0.43, 0.22, 0.01), b"gXYZ": (0.39, 0.72, 0.1), b"bXYZ": (0.14, 0.06, 0.71)}
    data = profile({**tags, **{name: xyz(one) for name, one in columns.items()}, b"vcgt": b"vcgt" + bytes(20)}, name="")
    read = read_display_profile("/tmp/left.icc", data)
    assert read.name == "left" and any("vcgt" in words for words in read.describe())


def test_the_white_of_a_display_and_what_codes_show_under_it(tmp_path):
    """By the matrix that adapted it, or the media white of version 2; D50 says nothing."""
    from_d65 = adaptation_matrix(np.array([0.9505, 1.0, 1.0890]), D50_XYZ)
    chad = b"sf32" + bytes(4) + b"".join(number(value) for value in from_d65.ravel())
    plain = matrix_profile()
    assert read_display_profile("", plain).white_xyz is None
    tags = {channel + b"TRC": curve(gamma=2.0) for channel in (b"r", b"g", b"b")}
    tags |= {channel + b"XYZ": xyz(COLUMNS[:, at]) for at, channel in enumerate((b"r", b"g", b"b"))}
    for more in ({b"chad": chad}, {b"wtpt": xyz((0.9505, 1.0, 1.0890))}):
        read = read_display_profile("", profile({**tags, **more}))
        np.testing.assert_allclose(read.white_xyz, (0.9505, 1.0, 1.0890), atol=1e-4)
        np.testing.assert_allclose(read.xyz(np.ones((1, 3)))[0], (0.9505, 1.0, 1.0890), atol=2e-4)
        half = read.xyz(np.full((1, 3), 0.5))[0]
        np.testing.assert_allclose(half, 0.25 * read.white_xyz, atol=1e-4)
    path = tmp_path / "desk.icc"
    path.write_bytes(plain)
    with pytest.raises(InputError, match="does not say which white"):
        claim_named(str(path))
