"""`metamer display` from patches to the page that is signed, as a person goes."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from icc_profiles import DULL, matrix_profile, profile
from metamer.benchmarks.display.simulated import displays
from metamer.calibration.display.characterise import characterise
from metamer.calibration.display.patches import patches
from metamer.spectral.formats.png_writer import png_bytes
from metamer.viewer.display.transform import DisplayTransform
from pictures import read_xyz_exr
from PIL import Image


def _write(path, count, purpose, seed):
    codes = np.round(patches(count, purpose) * 255.0) / 255.0
    found = displays()[2].measured(codes, seed)
    rows = [",".join(f"{value:.7g}" for value in (*c * 255.0, *x)) for c, x in zip(found.codes, found.xyz, strict=True)]
    path.write_text("r,g,b,X [cd/m2],Y [cd/m2],Z [cd/m2]\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return path


def _ccss(path, number):
    """Write the spectra of red, green, blue and white of one of the displays."""
    spectra = displays()[number].spectra(np.array([*np.eye(3), np.ones(3)]))
    bands = " ".join(f"SPEC_{nm:.0f}" for nm in spectra.wavelengths_nm)
    rows = [" ".join([f"{at + 1}", *(f"{value:.6g}" for value in row)]) for at, row in enumerate(spectra.radiance)]
    ends = f'SPECTRAL_START_NM "{spectra.wavelengths_nm[0]}"\nSPECTRAL_END_NM "{spectra.wavelengths_nm[-1]}"'
    head = f'CCSS\n\nDISPLAY "Screen"\nSPECTRAL_BANDS "{len(spectra.wavelengths_nm)}"\n{ends}\nSPECTRAL_NORM "1"'
    data = f"BEGIN_DATA_FORMAT\nSAMPLE_ID {bands}\nEND_DATA_FORMAT\nNUMBER_OF_SETS {len(rows)}\nBEGIN_DATA"
    path.write_text("\n".join([head, data, *rows, "END_DATA", ""]), encoding="utf-8")
    return path


def test_from_patches_to_a_signed_page(metamer, tmp_path):
    first, again = _write(tmp_path / "a.csv", 40, "characterise", 0), _write(tmp_path / "b.csv", 30, "verify", 1)
    display, folder = tmp_path / "desk.json", tmp_path / "desk"
    assert metamer("display", "patches", "-n", 40, "-o", tmp_path / "p.ti1")[0] == 0
    words = ["display", "characterise", first, "-o", display, "--model", "gog", "--name", "Desk"]
    code, said, err = metamer(*words)
    assert code == 0 and "gog: asked for" in said and not err
    code, said, err = metamer(*words, "--primaries", _ccss(tmp_path / "desk.ccss", 2))
    assert code == 0 and "for other observers: 4 spectra of Screen" in said and not err
    code, _, err = metamer(*words, "--primaries", _ccss(tmp_path / "other.ccss", 0))
    assert code == 4 and "primaries of another display" in err
    code, said, _ = metamer("display", "config", display, "-o", folder, "--icc", "--white", "native")
    assert "For observer 1964_10: white" in said
    assert code == 0 and (folder / "Desk.ocioz").is_file() and (folder / "Desk.icc").is_file()
    assert metamer("display", "characterise", first, "-o", display, "--model", "gog", "--observer", "10")[0] == 0
    picture = tmp_path / "p.png"
    Image.fromarray(np.full((2, 2, 3), (0, 255, 0), dtype=np.uint8)).save(picture)
    said = metamer("display", "proof", display, picture)[1]
    assert "white D65, x 0.3138, y 0.3310" in said
    page, figures = tmp_path / "v.html", tmp_path / "v.json"
    words = ["display", "verify", folder / "display.json", again, "--html", page, "--json", figures]
    code, said, _ = metamer(*words)
    found = json.loads(figures.read_text(encoding="utf-8"))
    average = next(row for row in found["rows"] if row["statistic"] == "average")
    assert average["value"] < 0.5 and "Signature" in page.read_text(encoding="utf-8")
    # Kept in the file of the display, so that the next one shows a trend.
    assert len(json.loads((folder / "display.json").read_text(encoding="utf-8"))["verifications"]) == 1
    code, _, err = metamer("display", "verify", folder / "display.json", first)
    assert code == 3 and "characterised with" in err
    code, said, _ = metamer("display", "claim", first, "--against", "sRGB")
    assert code == 0 and "against sRGB" in said
    # The profile that was made of these readings tells more than sRGB does.
    off = {name: float(re.findall(r"mean ([\d.]+)", said)[0])
           for name in ("sRGB", folder / "Desk.icc")
           for said in [metamer("display", "claim", first, "--against", name)[1]]}  # fmt: skip
    assert off[folder / "Desk.icc"] < 0.8 < 2.0 < off["sRGB"]
    code, _, err = metamer("display", "claim", first, "--observer", "10")
    assert code == 4 and "another observer than the claim's" in err
    code, _, err = metamer("display", "claim", first, "--against", "sGRB")
    assert code == 64 and "sRGB" in err
    code, _, err = metamer("display", "claim", first, "--against", tmp_path / "none.icc")
    assert code == 4 and "no such file" in err
    code, said, _ = metamer("display", "proof", folder / "display.json", picture, "-o", tmp_path / "lost.png")
    assert code in (0, 1) and "of 4 pixels" in said and (tmp_path / "lost.png").is_file()


def test_a_proof_judges_by_the_aim_of_the_configuration(metamer, tmp_path):
    """White is shown whatever it becomes: as the display's own it is all codes, and nothing of it is lost."""
    first, display, picture = _write(tmp_path / "a.csv", 40, "characterise", 0), tmp_path / "d.json", tmp_path / "p.png"
    assert metamer("display", "characterise", first, "-o", display, "--model", "gog")[0] == 0
    Image.fromarray(np.full((1, 2, 3), ((255,) * 3, (0,) * 3), dtype=np.uint8)).save(picture)
    for options, words, lost in (
        (("--white", "native"), "white the display's own, x 0.2989", 1),
        (("--white", "0.3,0.32", "--black", "bpc"), "white as asked for, x 0.3000, y 0.3200", 0),
        (("--luminance", "60"), "white D65, x 0.3127, y 0.3290, 60.0 cd/m2", 1),
    ):
        folder = tmp_path / f"to{len(list(tmp_path.iterdir()))}"
        assert metamer("display", "config", display, "-o", folder, *options)[0] == 0
        said = metamer("display", "proof", folder / "display.json", picture)[1]
        assert words in said and f"{lost} of 2 pixels" in said, said
        # It is black's, and no gamut's.
        assert ("1 of them darker than its black" in said) == (lost == 1)
        assert ("black moved" in said) == ("bpc" in options)
    # An answer on the command goes before.
    assert "white as asked for" not in metamer("display", "proof", display, picture)[1]
    said = metamer("display", "proof", folder / "display.json", picture, "--luminance", "50", "--black", "bpc")[1]
    assert "50.0 cd/m2, black moved" in said and "0 of 2 pixels" in said
    damaged = json.loads(display.read_text(encoding="utf-8")) | {"aim": {"white": "d56"}}
    display.write_text(json.dumps(damaged), encoding="utf-8")
    code, _, err = metamer("display", "proof", display, picture)
    assert code == 4 and "a damaged file of a display" in err


def test_a_scene_is_proofed_for_a_profile(metamer, scene, tiny_catalogue, tmp_path):
    """As the picture itself is; options that have no meaning are refused."""
    (tmp_path / "desk.icc").write_bytes(matrix_profile(columns=DULL, name="Desk"))
    picture, lost = tmp_path / "ball.png", tmp_path / "lost.png"
    own = ["--catalogue", tiny_catalogue, "--renderer", "software"]
    words = ["display", "proof", tmp_path / "desk.icc", scene, "-o", lost, "--illuminant", "A", *own]
    code, said, err = metamer(*words)
    count = int(re.findall(r": (\d+) of 1024 pixels", said)[0])
    assert code == (1 if count else 0), err
    assert "on ICC: Desk" in said and (np.asarray(Image.open(lost)) == (255, 0, 255)).all(axis=-1).sum() == count
    exr = tmp_path / "ball.exr"
    assert metamer("render", scene, "-o", exr, "--illuminant", "A", *own)[0] == 0
    image, coverage = read_xyz_exr(exr)
    display = DisplayTransform(f"icc:{tmp_path / 'desk.icc'}")
    ball = coverage == 1
    xyz = image.values[ball].astype(float) @ display.adaptation_from(image.white_xyz).T
    beyond = np.logical_or(*display.out_of_range(xyz, display.apply(xyz)))
    marked = (np.asarray(Image.open(lost))[ball] == (255, 0, 255)).all(axis=-1)
    assert marked.any() and (marked != beyond).mean() < 0.02
    # The same picture as a file: its 8 bits count as much, to within rounding.
    assert metamer("render", scene, "-o", picture, "--illuminant", "A", *own)[0] == 0
    code, said, _ = metamer("display", "proof", tmp_path / "desk.icc", picture)
    assert int(re.findall(r": (\d+) of 1024 pixels", said)[0]) == pytest.approx(count, abs=20)
    for option, subject, message in (
        (("--camera", "view"), picture, "of scenes"),
        (("--luminance", "80"), scene, "a profile says its white"),
    ):
        code, _, err = metamer("display", "proof", tmp_path / "desk.icc", subject, *option)
        assert code == 64 and message in err


def test_a_scene_is_proofed_for_its_observer(metamer, scene, tiny_catalogue, tmp_path):
    """Spectra of the display tell how to aim it for that observer; without them it is said that it is not."""
    display, codes = displays()[2], patches(30)
    read = display.measured(codes, 0)
    text = scene.read_text(encoding="utf-8")
    scene.write_text(text.replace("[scene]", '[scene]\nobserver = "1964_10"'), encoding="utf-8")
    own = [scene, "--catalogue", tiny_catalogue, "--renderer", "software"]
    for spectra, words in (
        (display.spectra(codes), "for 1964_10, white D65, x 0.3138, y 0.3310"),
        (None, "still aimed for 1931_2"),
    ):
        characterise(replace(read, spectra=spectra), "Desk", "gog").record.write(tmp_path / "desk.json")
        code, said, err = metamer("display", "proof", tmp_path / "desk.json", *own)
        assert code in (0, 1) and words in said, said + err


def test_the_profile_of_a_picture_is_applied(metamer, tmp_path):
    """Codes of a display with its own profile are all colours that it can show."""
    codes = np.random.default_rng(3).integers(0, 256, (8, 8, 3), dtype=np.uint8)
    (tmp_path / "desk.icc").write_bytes(matrix_profile(columns=DULL, name="Desk"))
    Image.fromarray(codes).save(tmp_path / "own.png", icc_profile=matrix_profile(columns=DULL, name="Desk"))
    code, said, err = metamer("display", "proof", tmp_path / "desk.icc", tmp_path / "own.png")
    assert (code, err) == (0, "") and "0 of 64 pixels" in said
    Image.fromarray(codes).save(tmp_path / "plain.png")
    assert metamer("display", "proof", f"icc:{tmp_path / 'desk.icc'}", tmp_path / "plain.png")[0] == 1
    for mode, name, said in (("CMYK", "ink.jpg", "colours in CMYK"), ("RGBA", "glass.png", "transparency")):
        Image.fromarray(codes).convert(mode).save(tmp_path / name)
        assert said in metamer("display", "proof", tmp_path / "desk.icc", tmp_path / name)[2]
    Image.fromarray(codes).save(tmp_path / "odd.png", icc_profile=profile({}, kind=b"prtr"))
    _, _, err = metamer("display", "proof", tmp_path / "desk.icc", tmp_path / "odd.png")
    assert "a profile that cannot be used" in err and "taken as sRGB" in err


@pytest.mark.parametrize(
    ("chunk", "words"),
    [((b"cICP", bytes([9, 16, 0, 1])), "PQ (cICP)"), ((b"cICP", bytes([9, 18, 0, 1])), "HLG (cICP)"),
     ((b"cLLI", bytes(8)), "not by which curve (cLLI)"), ((b"mDCv", bytes(24)), "not by which curve (mDCv)")],
)  # fmt: skip
def test_hdr_metadata_is_no_srgb(metamer, tmp_path, chunk, words):
    """A picture in PQ has other codes for every colour."""
    (tmp_path / "desk.icc").write_bytes(matrix_profile())
    (tmp_path / "p.png").write_bytes(png_bytes(np.zeros((2, 2, 3), dtype=np.uint8), [chunk]))
    code, said, err = metamer("display", "proof", tmp_path / "desk.icc", tmp_path / "p.png")
    assert code == 4 and not said and "an HDR display" in err and words in err and "p.png" in err


def test_what_a_file_leaves_open_is_asked(metamer, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("r,g,b,X,Y,Z\n0,0,0,0.1,0.1,0.1\n100,100,100,90,95,99\n", encoding="utf-8")
    code, _, err = metamer("display", "characterise", path, "-o", tmp_path / "d.json")
    assert code == 4 and "--codes" in err and not (tmp_path / "d.json").exists()
