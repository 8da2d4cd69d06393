"""Notes on a BTF's images: headers that ask for what is not done, and one named in place of its set."""

import pytest
from metamer.materials.formats.btf import header_notes, read_sources
from metamer.materials.formats.registry import format_for
from metamer.runtime.errors import InputError
from metamer.spectral.formats.import_options import ImportOptions
from PIL import Image, ImageCms

NAMES = [f"{n:05d} tl{tl:03d} pl000 tv000 pv000.jpg" for n, tl in enumerate((0, 15, 30, 45))]


@pytest.fixture
def wool(tmp_path):
    folder = tmp_path / "wool"
    folder.mkdir()
    exif = Image.Exif()
    exif[0x0112] = 6
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    picture = Image.new("RGB", (8, 8), (90, 120, 60))
    for name, more in zip(NAMES, ({}, {"exif": exif}, {"exif": exif}, {"icc_profile": profile}), strict=True):
        picture.save(folder / name, **more)
    return folder


def test_images_that_are_to_be_turned_and_profiles_are_named(wool):
    notes = header_notes([wool / name for name in NAMES], wool)
    assert notes == [
        f"images to be turned by EXIF: 2 ({NAMES[1]}: 6), read as they are stored",
        f"images with an ICC profile: 1 ({NAMES[3]}), not applied",
    ]


def test_plain_and_damaged_images_give_no_note(wool):
    (wool / NAMES[2]).write_bytes(b"no image")
    assert header_notes([wool / NAMES[0], wool / NAMES[2]], wool) == []


def test_the_record_says_so(wool):
    (one,) = read_sources(wool / NAMES[0], "mallett-yuksel", ImportOptions(encoding="srgb", white=(1.0,)))
    assert f"EXIF: 2 ({NAMES[1]}: 6)" in one.provenance.notes and "ICC profile" in one.provenance.notes


def test_an_image_that_does_not_stand_for_its_set_is_refused_with_the_one_that_does(wool):
    with pytest.raises(InputError, match="one image of a BTF") as caught:
        format_for(wool / NAMES[2], named=True)
    assert NAMES[0] in str(caught.value) and "one of 4" in str(caught.value)
    assert format_for(wool / NAMES[0], named=True).NAME == "BTF"
