"""The benchmark of fits under several kernels at work."""

import json
import subprocess
import sys

import pytest
from metamer.benchmarks.fits import main

FITS = (sys.executable, "-m", "metamer.benchmarks.fits")
FAMILY = """
family = "bench"
kind = "analytic"

[[material]]
name = "satin"
model = "ashikhmin_shirley"
diffuse = { constant = 0.3 }
specular = { constant = 0.04 }
exponent_u = 25.0
exponent_v = 25.0
"""


@pytest.mark.slow
def test_rows_and_table(tmp_path):
    (tmp_path / "bench.toml").write_text(FAMILY)
    words = [str(tmp_path / "bench.toml"), "--kernels", "Haswell,Prescott", "--json", str(tmp_path / "rows.json")]
    done = subprocess.run([*FITS, *words, "--budget", "1"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    rows = json.loads((tmp_path / "rows.json").read_text())
    assert [(row["kernel"], row["material"]) for row in rows] == [
        ("Haswell", "bench/satin"),
        ("Prescott", "bench/satin"),
    ]
    assert all(row["p99"] <= 1.0 and row["lowest"] >= -0.02 and row["seconds"] > 0.0 for row in rows)
    assert "bench/satin" in done.stdout


def test_what_holds_no_surface_is_said(tmp_path):
    (tmp_path / "grey.csv").write_text(
        "wavelength_nm,grey reflectance\n" + "".join(f"{n},0.5\n" for n in range(380, 781, 5))
    )
    with pytest.raises(SystemExit, match="none of these files"):
        main([str(tmp_path / "grey.csv"), "--kernels", "Haswell"])
