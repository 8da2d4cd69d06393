"""Headers of pictures that state other colours than sRGB: said where the picture is a colour, and nowhere else."""

import io
import struct
import zlib

import numpy as np
import pytest
from metamer.materials.formats.btf import header_notes
from metamer.materials.svbrdf.textures import Texture
from metamer.runtime.errors import InputError
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.formats.picture_header import SRGB_XY
from metamer.viewer.display.received_picture import read_picture
from PIL import Image, ImageCms, features

P3_XY = (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.3290)
GREY = Image.new("RGB", (2, 3), (90, 120, 60))


def saved(form, **more):
    data = io.BytesIO()
    GREY.save(data, form, **more)
    return data.getvalue()


def png(*chunks, icc=None):
    """A PNG with these chunks before its pixels."""
    data = saved("PNG", **({"icc_profile": icc} if icc else {}))
    told = b"".join(struct.pack(">I", len(c)) + k + c + struct.pack(">I", zlib.crc32(k + c)) for k, c in chunks)
    return data[:33] + told + data[33:]


def gamma(value):
    return b"gAMA", struct.pack(">I", round(value * 100_000))


def chromaticities(xy):
    return b"cHRM", struct.pack(">8I", *(round(v * 100_000) for v in (*xy[6:], *xy[:6])))


def codes(primaries, curve, full=1):
    return b"cICP", bytes([primaries, curve, 0, full])


RENDERING = (b"sRGB", b"\0")
SRGB_PROFILE = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()


def profile(curve):
    """The profile of sRGB with another curve, a gamma, under the same name."""
    made, place = bytearray(SRGB_PROFILE), SRGB_PROFILE.find(b"para")
    struct.pack_into(">HH5i", made, place + 8, 3, 0, *(round(v * 65536) for v in (curve, 1.0, 0.0, 1.0, 0.0)))
    return bytes(made)


def exif(**tags):
    """Exif by the numbers of its own tags."""
    made = Image.Exif()
    for name, value in tags.items():
        made.get_ifd(0x8769)[int(name[1:])] = value
    return made


def exif_of_interoperability(index):
    """Exif of uncalibrated colours with the index of interoperability, by its specification: Pillow writes none."""
    folder = struct.pack("<HHHIII", 1, 0x8769, 4, 1, 26, 0)
    own = struct.pack("<HHHIHHHHIII", 2, 0xA001, 3, 1, 65535, 0, 0xA005, 4, 1, 56, 0)
    other = struct.pack("<HHHI4sI", 1, 1, 2, 4, index, 0)
    return b"Exif\0\0" + b"II*\0" + struct.pack("<I", 8) + folder + own + other


def tiff(**tags):
    return saved("TIFF", tiffinfo={int(name[1:]): value for name, value in tags.items()})


def tga(above, below):
    """A TGA of version 2 with a gamma, by its specification: Pillow writes no extension area."""
    pixels = saved("TGA").removesuffix(b"\0" * 8 + b"TRUEVISION-XFILE.\0")
    area = struct.pack("<H", 495).ljust(478, b"\0") + struct.pack("<HH", above, below)
    return pixels + area.ljust(495, b"\0") + struct.pack("<II", len(pixels), 0) + b"TRUEVISION-XFILE.\0"


def bmp(kind, ends=(0,) * 9, gammas=(0, 0, 0)):
    """A picture of one pixel with a header of version 4."""
    head = struct.pack("<IiiHHIIiiII4I", 108, 1, 1, 1, 24, 0, 4, 2835, 2835, 0, 0, 0, 0, 0, 0) + kind
    head += struct.pack("<9i", *(round(v * (1 << 30)) for v in ends)) + struct.pack(
        "<3I", *(round(v * 65536) for v in gammas)
    )
    return b"BM" + struct.pack("<IHHI", 14 + 108 + 4, 0, 0, 14 + 108) + head + b"\1\2\3\0"


def ends_of(xy):
    """Red, green and blue in XYZ that add up to the white, Y 1."""
    columns = np.array([[x, y, 1 - x - y] for x, y in np.reshape(xy, (4, 2))]).T
    white = columns[:, 3] / columns[1, 3]
    return (columns[:, :3] * np.linalg.solve(columns[:, :3], white)).T.ravel()


STATED = {
    "gamma 1": (png(gamma(1.0)), "linear (gAMA 1)"),
    "gamma 1.8": (png(gamma(1 / 1.8)), "gamma 1.8 (gAMA 0.55556)"),
    "gamma 2.6": (png(gamma(1 / 2.6)), "gamma 2.6 (gAMA 0.38462)"),
    "gamma 1 beside sRGB": (png(RENDERING, gamma(1.0)), "linear (gAMA 1) beside sRGB"),
    "P3 by cHRM": (png(chromaticities(P3_XY)), "white 0.68 0.32, 0.265 0.69, 0.15 0.06, 0.3127 0.329 (cHRM)"),
    "P3 and linear": (png(gamma(1.0), chromaticities(P3_XY)), "linear (gAMA 1), primaries and white 0.68"),
    "white D50": (png(chromaticities((*SRGB_XY[:6], 0.3457, 0.3585))), "0.3457 0.3585 (cHRM)"),
    "PQ": (png(codes(9, 16)), "primaries of BT.2020 (cICP), PQ (cICP)"),
    "HLG": (png(codes(9, 18)), "primaries of BT.2020 (cICP), HLG (cICP)"),
    "P3 by cICP": (png(codes(12, 13)), "primaries of Display P3 (cICP)"),
    "linear by cICP": (png(codes(1, 8)), "linear (cICP)"),
    "a curve nobody knows": (png(codes(200, 77)), "primaries of number 200 (cICP), curve number 77 (cICP)"),
    "video range": (png(codes(1, 13, 0)), "numbers of video range (cICP)"),
    "cICP before sRGB and gAMA": (png(RENDERING, gamma(1 / 2.2), codes(9, 16)), "PQ (cICP)"),
    "PQ beside a profile": (png(codes(9, 16), icc=SRGB_PROFILE), "PQ (cICP)"),
    "a profile that cannot be unpacked": (png((b"iCCP", b"x\0\0garbage"), gamma(1.0)), "linear (gAMA 1)"),
    "only a profile that cannot be unpacked": (png((b"iCCP", b"x\0\0garbage")), "a colour profile that cannot be read"),
    "a torn profile in a JPEG": (
        saved("JPEG", icc_profile=SRGB_PROFILE).replace(b"ICC_PROFILE\0\1\1", b"ICC_PROFILE\0\1\2"),
        "a colour profile that cannot be read",
    ),
    "gamma 1 beside unspecified codes": (png(codes(1, 2), gamma(1.0)), "linear (gAMA 1)"),
    "P3 beside unspecified codes": (png(codes(2, 13), chromaticities(P3_XY)), "white 0.68 0.32"),
    "brightness and colour apart": (png((b"cICP", bytes([1, 13, 1, 1]))), "by matrix number 1 (cICP)"),
    "gamma of a TGA": (tga(18, 10), "gamma 1.8 (TGA 0.5"),
    "linear TGA": (tga(10, 10), "linear (TGA 1)"),
    "Adobe RGB in a JPEG": (saved("JPEG", exif=exif(e40961=2)), "Adobe RGB (Exif)"),
    "Adobe RGB by interoperability": (saved("JPEG", exif=exif_of_interoperability(b"R03\0")), "Adobe RGB (Exif)"),
    "uncalibrated": (saved("JPEG", exif=exif(e40961=65535)), "not sRGB (Exif: uncalibrated)"),
    "gamma of Exif": (saved("JPEG", exif=exif(e42240=1.0)), "linear (Exif 1)"),
    "Exif in a PNG": (png((b"eXIf", exif_of_interoperability(b"R03\0")[6:])), "Adobe RGB (Exif)"),
    "Exif in a WebP": (saved("WEBP", exif=exif(e40961=2)), "Adobe RGB (Exif)"),
    "primaries of a TIFF": (tiff(t318=P3_XY[6:], t319=P3_XY[:6]), "primaries and white 0.68 0.32"),
    "white of a TIFF": (tiff(t318=(0.3457, 0.3585)), "0.3457 0.3585 (TIFF)"),
    "curve of a TIFF": (tiff(t301=tuple(range(256)) * 3), "a curve of its own (TIFF: TransferFunction)"),
    "calibrated BMP": (bmp(b"\0\0\0\0", ends_of(P3_XY), (1, 1, 1)), "calibrated BMP), linear (calibrated BMP 1)"),
    "BMP with a profile": (bmp(b"DEBM"), "a colour profile (BMP)"),
}  # fmt: skip
STATED["light levels of HDR"] = png((b"cLLI", bytes(8))), "not by which curve (cLLI)"
STATED["a mastering display beside sRGB"] = png(RENDERING, (b"mDCV", bytes(24))), "not by which curve (mDCV)"
PLAIN = {
    "nothing": saved("PNG"),
    "sRGB": png(RENDERING),
    "sRGB with what belongs to it": png(RENDERING, gamma(1 / 2.2), chromaticities(SRGB_XY)),
    "gamma 2.2 alone": png(gamma(1 / 2.2)),
    "primaries of sRGB": png(chromaticities(SRGB_XY)),
    "sRGB by cICP": png(codes(1, 13)),
    "unspecified by cICP": png(codes(2, 2)),
    "cICP of sRGB before another gamma": png(codes(1, 13), gamma(1.0)),
    "unspecified codes before a profile": png(codes(2, 2), gamma(1.0), icc=SRGB_PROFILE),
    "codes of sRGB before a torn profile": png(codes(1, 13), (b"iCCP", b"x\0\0garbage")),
    "a TGA of gamma 2.2": tga(22, 10),
    "a TGA that says no gamma": tga(0, 0),
    "a profile before another gamma": png(gamma(1.0), icc=SRGB_PROFILE),
    "gamma of nothing": png(gamma(0.0)),
    "sRGB in Exif": saved("JPEG", exif=exif(e40961=1)),
    "uncalibrated with a profile": saved("JPEG", exif=exif(e40961=65535), icc_profile=SRGB_PROFILE),
    "a plain TIFF": saved("TIFF"),
    "a TIFF of sRGB": tiff(t318=SRGB_XY[6:], t319=SRGB_XY[:6]),
    "a plain BMP": saved("BMP"),
    "a BMP of sRGB": bmp(b"BGRs"),
    "a BMP calibrated as sRGB": bmp(b"\0\0\0\0", ends_of(SRGB_XY), (2.2, 2.2, 2.2)),
    "a BMP that calibrates nothing": bmp(b"\0\0\0\0"),
}


def notes_of(data, folder, slot="base_color", encoding="sRGB"):
    name = "a.tga" if data.endswith(b"TRUEVISION-XFILE.\0") else "a.png"
    return Texture(slot, data, encoding, folder / name, "maps").notes


@pytest.mark.parametrize("case", STATED)
def test_other_colours_than_srgb_are_said(case, tmp_path):
    data, words = STATED[case]
    (note,) = notes_of(data, tmp_path)
    assert note.startswith("the base_color map says ") and note.endswith("which is not applied: it is taken as sRGB")
    assert words in note


@pytest.mark.parametrize("case", PLAIN)
def test_srgb_and_nothing_need_no_words(case, tmp_path):
    assert notes_of(PLAIN[case], tmp_path) == ()


@pytest.mark.parametrize("form", ["PNG", "JPEG", "WEBP"])
@pytest.mark.parametrize("slot", ["base_color", "roughness"])
@pytest.mark.parametrize("orientation", [1, 3, 6, 8])
def test_a_picture_that_is_to_be_turned_is_said(form, slot, orientation, tmp_path):
    told = Image.Exif()
    told[274] = orientation
    notes = notes_of(saved(form, exif=told), tmp_path, slot, "linear" if slot == "roughness" else "sRGB")
    assert len(notes) == (orientation != 1)
    assert all(f"the {slot} map says that it is to be turned (Exif, orientation {orientation})" in one for one in notes)


@pytest.mark.parametrize("form", ["PNG", "JPEG", "TIFF", "WEBP"])
def test_a_profile_is_known_by_its_colours_and_not_by_its_name(form, tmp_path):
    """Profiles of linear light are called "sRGB" as well, as those of editors of pictures are."""
    for curve, plain in ((1.0, False), (1.8, False), (2.2, True)):
        named = profile(curve)
        renamed = named.replace(b"sRGB", b"grey").replace("sRGB".encode("utf-16-be"), "mine".encode("utf-16-be"))
        for icc in (named, renamed):
            notes = notes_of(saved(form, icc_profile=icc), tmp_path)
            assert notes == () if plain else "carries a colour profile of its own" in notes[0], curve


def test_a_profile_of_floats_is_said_beside_what_they_are_taken_for(tmp_path):
    data = io.BytesIO()
    Image.new("F", (2, 3), 0.5).save(data, "TIFF", icc_profile=profile(1.8))
    (note,) = notes_of(data.getvalue(), tmp_path)
    assert "colour profile of its own" in note and note.endswith("it is taken as linear, of the primaries of sRGB")


@pytest.mark.parametrize("case", STATED)
def test_maps_of_plain_numbers_are_no_colours(case, tmp_path):
    assert notes_of(STATED[case][0], tmp_path, "roughness", "linear") == ()


@pytest.mark.skipif(not features.check("avif"), reason="this Pillow writes no AVIF")
@pytest.mark.parametrize("coded, words", [((12, 16), "primaries of Display P3 (nclx), PQ (nclx)"), ((1, 13), "")])
def test_codes_of_an_avif(coded, words, tmp_path):
    data = bytearray(saved("AVIF"))
    place = data.find(b"colrnclx")
    struct.pack_into(">HH", data, place + 8, *coded)
    notes = notes_of(bytes(data), tmp_path)
    assert (words in notes[0]) if words else notes == ()


EXRS = {
    "P3": ({"chromaticities": P3_XY}, "primaries and white 0.68 0.32"),
    "ACES": (
        {"chromaticities": (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)},
        "-0.077",
    ),
    "ACEScg by name": ({"colorInteropID": "lin_ap1_scene"}, "lin_ap1_scene (colorInteropID)"),
}
PLAIN_EXRS = {
    "nothing": {},
    "sRGB": {"chromaticities": SRGB_XY},
    "linear sRGB by name": {"colorInteropID": "lin_rec709_scene"},
}


def exr(folder, header):
    path = folder / "a.exr"
    write_exr(path, header, {name: np.full((2, 3), 0.4, np.float32) for name in "RGB"})
    return path.read_bytes()


@pytest.mark.parametrize("case", EXRS)
def test_primaries_of_an_exr_are_said(case, tmp_path):
    header, words = EXRS[case]
    (note,) = notes_of(exr(tmp_path, header), tmp_path)
    assert words in note and note.endswith("it is taken as linear, of the primaries of sRGB")
    assert notes_of(exr(tmp_path, header), tmp_path, "roughness", "linear") == ()


@pytest.mark.parametrize("case", PLAIN_EXRS)
def test_an_exr_of_srgb_needs_no_words(case, tmp_path):
    assert notes_of(exr(tmp_path, PLAIN_EXRS[case]), tmp_path) == ()


def test_images_of_a_btf_in_exr_say_so_by_the_first(tmp_path):
    exr(tmp_path, EXRS["P3"][0])
    (tmp_path / "b.exr").write_bytes(b"no picture")
    (note,) = header_notes([tmp_path / "a.exr", tmp_path / "b.exr"], tmp_path)
    assert note.startswith("images that say primaries and white 0.68") and "(a.exr)" in note
    exr(tmp_path, PLAIN_EXRS["sRGB"])
    assert header_notes([tmp_path / "a.exr"], tmp_path) == header_notes([tmp_path / "b.exr"], tmp_path) == []
    write_exr(tmp_path / "a.exr", EXRS["P3"][0], {name: np.ones((2, 2), np.float32) for name in "XYZ"})
    assert header_notes([tmp_path / "a.exr"], tmp_path) == []


@pytest.mark.parametrize("length", [0, 1, 3, 5, 40])
def test_codes_of_another_length_than_they_have_say_nothing(length, tmp_path):
    assert notes_of(png((b"cICP", b"\x09\x10\0\1"[:length].ljust(length, b"\1"))), tmp_path) == ()


@pytest.mark.parametrize("damage", [b"Exif\0\0", b"Exif\0\0II*\0\xff\xff\xff\xff", b"Exif\0\0garbage" * 3])
def test_damaged_exif_says_nothing_and_the_picture_is_read(damage, tmp_path):
    texture = Texture("base_color", saved("JPEG", exif=damage), "sRGB", tmp_path / "a.jpg", "maps")
    assert texture.notes == () and texture.size == (3, 2)


def test_images_of_a_btf_and_pictures_that_somebody_sends_say_so_too(tmp_path):
    for name, data in (("a.png", STATED["PQ"][0]), ("b.png", STATED["PQ"][0]), ("c.png", PLAIN["sRGB"])):
        (tmp_path / name).write_bytes(data)
    files = [tmp_path / name for name in ("a.png", "b.png", "c.png")]
    assert header_notes(files, tmp_path) == [
        "images that say primaries of BT.2020 (cICP), PQ (cICP): 2 (a.png), not applied"
    ]
    with pytest.raises(InputError, match=r"HDR display[^\n]*\n  found: primaries of BT.2020 \(cICP\), PQ \(cICP\)"):
        read_picture(files[0])
    files[0].write_bytes(STATED["gamma 1"][0])
    assert read_picture(files[0])[2] == ("linear (gAMA 1)",) and read_picture(files[2])[2] == ()


def test_code_points_of_srgb_stand_above_a_profile_of_other_colours(tmp_path):
    for name, data in (("a.png", png(codes(1, 13), icc=profile(1.0))), ("b.png", PLAIN["sRGB"])):
        (tmp_path / name).write_bytes(data)
    ours, plain = (read_picture(tmp_path / name) for name in ("a.png", "b.png"))
    assert ours[2] == () and np.array_equal(ours[1], plain[1])


def test_grey_of_16_bits_that_somebody_sends_is_scaled_and_not_cut_off(tmp_path):
    Image.fromarray(np.array([[0, 257, 128 * 257, 65535]], np.uint16)).save(tmp_path / "a.png")
    assert read_picture(tmp_path / "a.png")[0][0, :, 1].tolist() == [0, 1, 128, 255]
    Image.fromarray(np.ones((2, 2), np.float32)).save(tmp_path / "a.tif")
    with pytest.raises(InputError, match="on no scale"):
        read_picture(tmp_path / "a.tif")
