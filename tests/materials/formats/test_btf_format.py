"""Reading BTFs: UBO2003's and UTIA's names, what is asked, and every refusal."""

import shutil
import zipfile

import numpy as np
import pytest
from btf_sets import NINE, written
from metamer.materials.btf.surface import MeasuredBtf
from metamer.materials.formats import btf as btf_format
from metamer.materials.intake.sources import read_sources
from metamer.materials.records.source import MaterialSource, Rejected
from metamer.runtime.errors import InputError
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.srgb import srgb_to_linear
from metamer.spectral.upsampling import xyz_from_rgb

SAID = ImportOptions(encoding="srgb", white=(1.0,))
UTIA = "tv{tv:03d}_pv{pv:03d}/tl{tl:03d}_pl{pl:03d}_tv{tv:03d}_pv{pv:03d}.png"


def read(folder, answer=SAID, uplift="mallett-yuksel"):
    (found,) = read_sources(folder, uplift, answer)
    return found


def btf(folder, answer=SAID):
    found = read(folder, answer)
    assert isinstance(found, MaterialSource), found.reason
    return found, MeasuredBtf.from_parameters(found.parameters)


def refused(folder, answer=SAID, uplift="mallett-yuksel"):
    found = read(folder, answer, uplift)
    assert isinstance(found, Rejected)
    return found.reason


@pytest.mark.parametrize("name", ["{n:05d} tl{tl:03d} pl{pl:03d} tv{tv:03d} pv{pv:03d}.png", UTIA])
def test_ubo_and_utia_names(tmp_path, name):
    codes = written(tmp_path / "Wool 2", name=name)
    source, surface = btf(tmp_path / "Wool 2")
    assert (source.id, source.family, source.model) == ("btf/wool-2", "btf", "btf")
    images = surface.images
    at = [tuple(pair) for pair in np.rint(source.original["views_degrees"]).astype(int).tolist()]
    for v, l in ((0, 0), (4, 7)):
        light = [tuple(pair) for pair in np.rint(source.original["lights_degrees"]).astype(int).tolist()].index(NINE[l])
        expected = srgb_to_linear(codes[v, l] / 255.0) / np.pi
        np.testing.assert_allclose(images.image(at.index(NINE[v]), light), expected, rtol=1e-6)
    np.testing.assert_allclose(surface.means[0, 0], images.image(0, 0).mean(axis=(0, 1)), rtol=1e-5)
    assert source.provenance.kind == "uplifted(mallett-yuksel)"
    assert source.stored == sum(path.stat().st_size for path in (tmp_path / "Wool 2").rglob("*.png"))
    assert "photographs" in source.provenance.notes and "9 views x 9 lights" in source.provenance.notes


def test_the_running_number_says_nothing(tmp_path):
    codes = written(tmp_path / "a")
    files = sorted((tmp_path / "a").iterdir())
    (tmp_path / "b").mkdir()
    for path, number in zip(files, np.random.default_rng(0).permutation(len(files)), strict=True):
        shutil.copy(path, tmp_path / "b" / f"{number:05d}{path.name[5:]}")
    one, other = (btf(tmp_path / name)[1].images for name in "ab")
    assert np.array_equal(one.image(5, 6), other.image(5, 6)) and codes.size


def test_encoding_and_white_are_asked_for(tmp_path):
    written(tmp_path / "wool", NINE[:1], NINE[:2])
    reason = str(refused(tmp_path / "wool", ImportOptions()))
    assert "do not say what their numbers are" in reason and "--encoding" in reason and "--white" in reason
    reason = str(refused(tmp_path / "wool", ImportOptions(encoding="linear")))
    assert "--white" in reason and "--encoding" not in reason.partition("try:")[2]


def test_a_white_that_is_not_1_is_divided_by(tmp_path):
    written(tmp_path / "wool", NINE[:2], NINE[:2])
    plain = btf(tmp_path / "wool")[1].images.image(1, 1)
    for white in ((0.5,), (0.5, 0.8, 1.25)):
        source, surface = btf(tmp_path / "wool", ImportOptions(encoding="srgb", white=white))
        np.testing.assert_allclose(surface.images.image(1, 1), plain / np.array(white), rtol=1e-6)
        assert f"a perfect diffuser is {white[0]:g}" in source.provenance.notes
    assert "one number, or 3" in str(refused(tmp_path / "wool", ImportOptions(encoding="srgb", white=(1.0, 0.9))))


def test_the_cosine_may_be_said_not_to_be_in_the_numbers(tmp_path):
    written(tmp_path / "wool", NINE[:1], [(0, 0), (60, 0)])
    plain, without = (
        btf(tmp_path / "wool", ImportOptions(encoding="srgb", white=(1.0,), includes_cosine=said))[1].images
        for said in (None, False)
    )
    np.testing.assert_allclose(without.image(0, 1), plain.image(0, 1) * 0.5, rtol=1e-6)


def test_the_width_of_a_texel_is_kept(tmp_path):
    written(tmp_path / "wool", NINE[:1], NINE[:1])
    source, surface = btf(tmp_path / "wool", ImportOptions(encoding="srgb", white=(1.0,), texel_mm=0.13))
    assert surface.images.texel_mm == 0.13 and "0.13 mm" in source.provenance.notes
    assert btf(tmp_path / "wool")[1].images.texel_mm is None


@pytest.mark.parametrize("size", [(1, 1), (3, 5)])
@pytest.mark.parametrize("lights", [NINE, [(30, 0)]], ids=["9 lights", "a single light"])
def test_few_texels_and_few_lights(tmp_path, size, lights):
    written(tmp_path / "wool", lights=lights, size=size)
    images = btf(tmp_path / "wool")[1].images
    assert (images.height, images.width, len(images.lights)) == (*size, len(lights))


@pytest.mark.parametrize(
    ("lights", "said"),
    [
        (NINE, "light measured up to 60 deg from the normal; beyond, f_r is held and its cosine falls on"),
        ([at for at in NINE if at != (60, 90)], "light measured up to 30 deg (60 on some sides) from the normal"),
        ([*NINE, *((90, phi) for phi in range(0, 360, 30))], None),
    ],
    ids=["all around", "one side lower", "down to the horizon"],
)
def test_grazing_light_that_nobody_measured_is_said(tmp_path, lights, said):
    written(tmp_path / "wool", lights=lights, size=(1, 1))
    notes = btf(tmp_path / "wool")[0].provenance.notes
    assert "views measured up to 60 deg from the normal; beyond, they are held" in notes
    assert said in notes if said else "light measured" not in notes


def test_a_view_and_a_ring_may_be_missing_as_a_whole(tmp_path):
    views = [at for at in NINE if at != (30, 90) and at[0] != 60]
    written(tmp_path / "wool", views, NINE)
    assert len(btf(tmp_path / "wool")[1].images.views) == 4


def without(folder, *parts):
    """Remove the images whose names hold all of `parts`."""
    gone = [path for path in folder.rglob("*.png") if all(part in path.name for part in parts)]
    for path in gone:
        path.unlink()
    return len(gone)


def test_a_missing_image_is_filled_and_named(tmp_path):
    written(tmp_path / "wool")
    assert without(tmp_path / "wool", "tl030 pl090 tv060 pv180") == 1
    reason = refused(tmp_path / "wool")
    assert "1 missing" in str(reason) and "tl030 pl090 tv060 pv180" in str(reason)
    source, surface = btf(tmp_path / "wool", ImportOptions(encoding="srgb", white=(1.0,), fill=0.02))
    assert "tl030 pl090 tv060 pv180" in source.provenance.notes and len(surface.images.missing) == 1
    view, light = surface.images.missing[0].tolist()
    np.testing.assert_allclose(surface.means[view, light], surface.images.image(view, light).mean((0, 1)), rtol=1e-5)


def test_more_than_the_share_is_refused_with_names(tmp_path):
    written(tmp_path / "wool")
    assert without(tmp_path / "wool", "tv060 pv180") == 9
    written(tmp_path / "one", [(60, 180)], NINE[:1])
    shutil.copy(next((tmp_path / "one").iterdir()), tmp_path / "wool")
    reason = str(refused(tmp_path / "wool", ImportOptions(encoding="srgb", white=(1.0,), fill=0.05)))
    assert "8 missing and 0 damaged of 81" in reason and "and 2 more" in reason and "--fill" in reason


@pytest.mark.parametrize("content", [b"", b"no picture", None], ids=["empty", "another file", "cut short"])
def test_a_damaged_image_is_named_and_filled(tmp_path, content):
    written(tmp_path / "wool", size=(16, 16))
    # Also the first of all, whose size would be that of the set.
    damaged = sorted((tmp_path / "wool").iterdir())[0]
    damaged.write_bytes(damaged.read_bytes()[:300] if content is None else content)
    reason = str(refused(tmp_path / "wool"))
    assert "1 damaged" in reason and damaged.name in reason
    source, surface = btf(tmp_path / "wool", ImportOptions(encoding="srgb", white=(1.0,), fill=0.02))
    assert damaged.name in source.provenance.notes and surface.images.height == 16
    assert np.isfinite(surface.means).all() and (surface.means > 0).all()


def test_an_openexr_set_may_begin_with_a_damaged_image(tmp_path):
    plane = np.full((2, 2), 0.2, np.float32)
    exr_set(tmp_path / "wool", dict.fromkeys("RGB", plane), [(0, 0), (20, 0), (40, 0)])
    (tmp_path / "wool" / "tl000_pl000_tv000_pv000.exr").write_bytes(b"")
    answer = ImportOptions(encoding="linear", white=(1.0,), fill=0.4)
    assert "tl000_pl000_tv000_pv000.exr" in btf(tmp_path / "wool", answer)[0].provenance.notes


def test_two_sets_in_a_folder_have_two_names(tmp_path):
    for name in ("silk", "wool"):
        written(tmp_path / "all", NINE[:1], NINE[:2], name=name + "_tl{tl:03d}_pl{pl:03d}_tv{tv:03d}_pv{pv:03d}.png")
    found = read_sources(tmp_path / "all", "mallett-yuksel", SAID)
    assert [one.id for one in found] == ["btf/all-silk", "btf/all-wool"]


def test_an_image_that_stands_twice_is_refused(tmp_path):
    written(tmp_path / "wool", NINE, NINE[:2])
    first = sorted((tmp_path / "wool").iterdir())[3]
    shutil.copy(first, first.with_name(f"99999{first.name[5:]}"))
    reason = str(refused(tmp_path / "wool"))
    assert "same directions" in reason and first.name in reason and f"99999{first.name[5:]}" in reason


def test_one_direction_by_two_names_stands_twice(tmp_path):
    written(tmp_path / "wool", [(0, 0), (0, 90), (30, 0), (30, 360)], NINE[:1])
    assert "same directions" in str(refused(tmp_path / "wool"))


@pytest.mark.parametrize(("views", "lights"), [([(0, 0), (95, 0)], NINE), (NINE, [(0, 0), (120, 0)])])
def test_directions_below_the_horizon_are_refused_by_name(tmp_path, views, lights):
    written(tmp_path / "wool", views, lights)
    reason = str(refused(tmp_path / "wool"))
    assert "below the horizon" in reason and ("tv095" in reason or "tl120" in reason)


@pytest.mark.parametrize("view", [(60, 180), (0, 0)])
def test_images_of_different_sizes_are_refused_by_name(tmp_path, view):
    """Also where it is the first one that is of another size."""
    written(tmp_path / "wool")
    written(tmp_path / "one", [view], NINE[:1], size=(4, 5))
    other = next((tmp_path / "one").iterdir())
    target = next(path for path in (tmp_path / "wool").iterdir() if path.name.endswith(other.name[5:]))
    shutil.copy(other, target)
    reason = str(refused(tmp_path / "wool", ImportOptions(encoding="srgb", white=(1.0,), fill=0.5)))
    assert "different sizes" in reason and target.name in reason and "5 x 4" in reason and "4 x 4" in reason


def test_an_uplift_that_is_not_linear_is_refused(tmp_path):
    written(tmp_path / "wool", NINE[:1], NINE[:1])
    assert "--uplift" in str(refused(tmp_path / "wool", uplift="smits"))


def test_a_quantity_that_it_is_not_is_refused(tmp_path):
    written(tmp_path / "wool", NINE[:1], NINE[:1])
    assert "one thing" in str(
        refused(tmp_path / "wool", ImportOptions(quantity="emission", encoding="srgb", white=(1.0,)))
    )


def test_a_zip_is_a_set_and_a_zip_in_it_is_not(tmp_path):
    codes = written(tmp_path / "wool", name=UTIA)
    with zipfile.ZipFile(tmp_path / "cloth.zip", "w") as archive:
        for path in sorted((tmp_path / "wool").rglob("*.png")):
            archive.write(path, path.relative_to(tmp_path / "wool"))
    with zipfile.ZipFile(tmp_path / "inner.zip", "w") as archive:
        archive.write(tmp_path / "cloth.zip", "cloth.zip")
    found = read(tmp_path / "cloth.zip")
    assert found.id == "btf/cloth" and found.parameters["index"].shape == (9, 9, 1) and codes.size
    assert "archive inside an archive" in str(refused(tmp_path / "inner.zip"))


def test_one_image_a_wavelength(tmp_path):
    from PIL import Image

    rng = np.random.default_rng(0)
    codes = rng.integers(0, 255, (3, 2, 4, 5)).astype(np.uint8)
    for band, nm in enumerate((450, 550, 650)):
        for light in range(2):
            path = tmp_path / "wool" / f"{nm}nm" / f"tl{30 * light:03d}_pl000_tv000_pv000.png"
            path.parent.mkdir(parents=True, exist_ok=True)
            Image.fromarray(codes[band, light]).save(path)
    source, surface = btf(tmp_path / "wool", ImportOptions(encoding="linear", white=(0.5,)))
    assert surface.wavelengths_nm.tolist() == [450.0, 550.0, 650.0] and source.provenance.kind == "measured"
    expected = np.moveaxis(codes[:, 1], 0, -1) / 255.0 / 0.5 / np.pi
    np.testing.assert_allclose(surface.images.image(0, 1), expected, rtol=1e-6)
    assert "held" in source.provenance.notes
    path.unlink()
    reason = str(refused(tmp_path / "wool", ImportOptions(encoding="linear", white=(0.5,))))
    assert "1 missing" in reason
    for nm in (450, 650):
        shutil.rmtree(tmp_path / "wool" / f"{nm}nm")
    assert "no spectrum" in str(refused(tmp_path / "wool", ImportOptions(encoding="linear", white=(0.5,))))


def exr_set(folder, channels, lights=((0, 0), (60, 0))):
    folder.mkdir()
    for theta, phi in lights:
        write_exr(folder / f"tl{theta:03d}_pl{phi:03d}_tv000_pv000.exr", {}, channels)


def test_spectral_openexr_needs_no_encoding(tmp_path):
    planes = {f"T.{nm},0nm": np.full((3, 4), value, np.float32) for nm, value in ((650, 0.6), (450, 0.2), (550, 0.4))}
    exr_set(tmp_path / "wool", planes)
    assert "--includes-cosine" in str(refused(tmp_path / "wool", ImportOptions()))
    source, surface = btf(tmp_path / "wool", ImportOptions(includes_cosine=False))
    found = surface.images.image(0, 1)[0, 0]
    np.testing.assert_allclose(found, np.array([0.2, 0.4, 0.6]) / np.pi * 0.5, rtol=1e-6)
    assert source.provenance.kind == "measured"
    assert "not what --encoding says" in str(
        refused(tmp_path / "wool", ImportOptions(encoding="xyz", includes_cosine=False))
    )


@pytest.mark.parametrize("names", ["XYZ", "RGB"])
def test_openexr_as_utia_writes_it_is_x_y_and_z(tmp_path, names):
    rgb = np.array([0.3, 0.2, 0.1])
    xyz = xyz_from_rgb() @ rgb
    exr_set(
        tmp_path / "wool", {name: np.full((2, 2), value, np.float32) for name, value in zip(names, xyz, strict=True)}
    )
    answer = ImportOptions(encoding="xyz" if names == "RGB" else None, white=(1.0,))
    np.testing.assert_allclose(btf(tmp_path / "wool", answer)[1].images.image(0, 0)[1, 1] * np.pi, rgb, rtol=1e-5)
    wrong = ImportOptions(encoding="srgb", white=(1.0,))
    assert "encoding" in str(refused(tmp_path / "wool", wrong)) or "linear" in str(refused(tmp_path / "wool", wrong))


@pytest.mark.parametrize("said", [{"white": (0.0,)}, {"texel_mm": -1.0}, {"fill": 1.0}])
def test_answers_that_are_none_are_refused(said):
    with pytest.raises(InputError, match=r"not a (positive number|share)"):
        ImportOptions(**said)


def test_numbers_below_zero_are_kept_and_counted(tmp_path):
    plane = np.full((2, 2), 0.2, np.float32)
    exr_set(tmp_path / "wool", {"R": plane, "G": plane, "B": np.array([[0.1, -0.01], [0.1, 0.1]], np.float32)})
    source, surface = btf(tmp_path / "wool", ImportOptions(encoding="linear", white=(1.0,)))
    assert "2 numbers are below 0" in source.provenance.notes and surface.images.image(0, 0).min() < 0


def test_a_number_that_is_none_is_damage(tmp_path):
    plane = np.full((2, 2), 0.2, np.float32)
    exr_set(tmp_path / "wool", dict.fromkeys("RGB", plane), [(0, 0), (20, 0), (40, 0)])
    broken = plane.copy()
    broken[0, 1] = np.nan
    write_exr(tmp_path / "wool" / "tl020_pl000_tv000_pv000.exr", {}, dict.fromkeys("RGB", broken))
    assert "1 damaged" in str(refused(tmp_path / "wool", ImportOptions(encoding="linear", white=(1.0,))))


def test_what_reading_takes_is_that_of_the_whole_set(tmp_path):
    written(tmp_path / "few", NINE[:2], NINE[:2], size=(20, 20))
    written(tmp_path / "many", size=(20, 20))
    few, many = (btf_format.reading_cost(next((tmp_path / name).iterdir())) for name in ("few", "many"))
    assert many.seconds == pytest.approx(few.seconds * 81 / 4) and 1 << 28 < few.bytes < many.bytes < 1 << 30
    exr_set(tmp_path / "exr", dict.fromkeys("RGB", np.zeros((20, 20), np.float32)))
    assert btf_format.reading_cost(next((tmp_path / "exr").iterdir())).seconds > 0
    # Memory for a set of 6561 images of 256 x 256 texels: less than there is.
    assert btf_format._PROCESS_BYTES + btf_format._VIEW_BYTES * 81 * 65536 < 1e9
