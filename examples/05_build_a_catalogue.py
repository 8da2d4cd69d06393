"""Describe two materials in a source folder, import them into a catalogue, and ask it questions."""

import hashlib
import sys
import tempfile
from pathlib import Path

from metamer import Catalogue, Query, import_sources
from metamer.runtime.errors import UnknownNameError

# A source folder: spectra, `sources.toml` with their origin, licence and hash, and one TOML file a family.
SPECTRA = "wavelength_nm,rust\n380,0.04\n480,0.06\n560,0.12\n620,0.34\n700,0.46\n780,0.52\n"
TABLES = """
[swatch]
file = "swatch.csv"
source = "A swatch made up for this example"
licence = "CC0 1.0"
geometry = "45:0"
sha256 = "{sha256}"
"""
FAMILY = """
family = "fabric"
kind = "analytic"

[[material]]
name = "rust-felt"
model = "oren_nayar"
reflectance = { table = "swatch", column = "rust" }
sigma = 0.5

[[material]]
name = "grey-card"
model = "lambert"
reflectance = { constant = 0.18 }
"""


def main(folder: Path) -> None:
    source = folder / "source"
    source.mkdir(parents=True, exist_ok=True)
    (source / "swatch.csv").write_text(SPECTRA, newline="\n")
    (source / "sources.toml").write_text(TABLES.format(sha256=hashlib.sha256(SPECTRA.encode()).hexdigest()))
    (source / "fabric.toml").write_text(FAMILY)
    for _ in range(2):  # the second time there is nothing to do
        print(import_sources([source], folder / "catalogue", jobs=1, budget=1.0).sentence)
    catalogue = Catalogue.open(folder / "catalogue")
    for record in map(catalogue.load, catalogue.match("fabric/*")):
        print(f"{record.id}: {record.model}, ΔE94 p99 {record.error.p99:.3f}, source: {record.provenance.source}")
    # By colour (CIELAB at 45:0, D65), by error, by family: the heads of the files alone are read.
    for found in catalogue.query(Query(near=(50.0, 20.0, 25.0))):
        print(f"{found.id}: ΔE94 {found.distance:.1f} from the colour asked for")
    try:
        catalogue.load("fabric/rust-flet")
    except UnknownNameError as reason:
        print(reason)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp(prefix="metamer-")))
