"""`metamer display` from patches to the page that is signed, as a person goes."""

import json
import re

import numpy as np
from metamer.benchmarks.display.simulated import displays
from metamer.calibration.display.patches import patches
from PIL import Image


def _write(path, count, purpose, seed):
    codes = np.round(patches(count, purpose) * 255.0) / 255.0
    found = displays()[2].measured(codes, seed)
    rows = [",".join(f"{value:.7g}" for value in (*c * 255.0, *x)) for c, x in zip(found.codes, found.xyz, strict=True)]
    path.write_text("r,g,b,X [cd/m2],Y [cd/m2],Z [cd/m2]\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return path


def test_from_patches_to_a_signed_page(metamer, tmp_path):
    first, again = _write(tmp_path / "a.csv", 40, "characterise", 0), _write(tmp_path / "b.csv", 30, "verify", 1)
    display, folder = tmp_path / "desk.json", tmp_path / "desk"
    assert metamer("display", "patches", "-n", 40, "-o", tmp_path / "p.ti1")[0] == 0
    code, said, err = metamer("display", "characterise", first, "-o", display, "--model", "gog", "--name", "Desk")
    assert code == 0 and "gog: asked for" in said and not err
    code, said, _ = metamer("display", "config", display, "-o", folder, "--icc", "--white", "native")
    assert code == 0 and (folder / "Desk.ocioz").is_file() and (folder / "Desk.icc").is_file()
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
    code, _, err = metamer("display", "claim", first, "--against", "sGRB")
    assert code == 64 and "sRGB" in err
    code, _, err = metamer("display", "claim", first, "--against", tmp_path / "none.icc")
    assert code == 4 and "no such file" in err
    picture = tmp_path / "p.png"
    Image.fromarray(np.full((2, 2, 3), (0, 255, 0), dtype=np.uint8)).save(picture)
    code, said, _ = metamer("display", "proof", folder / "display.json", picture, "-o", tmp_path / "lost.png")
    assert code in (0, 1) and "of 4 pixels" in said and (tmp_path / "lost.png").is_file()


def test_what_a_file_leaves_open_is_asked(metamer, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("r,g,b,X,Y,Z\n0,0,0,0.1,0.1,0.1\n100,100,100,90,95,99\n", encoding="utf-8")
    code, _, err = metamer("display", "characterise", path, "-o", tmp_path / "d.json")
    assert code == 4 and "--codes" in err and not (tmp_path / "d.json").exists()
