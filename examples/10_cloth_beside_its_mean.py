"""A twill as its BTF beside its mean spectrum, which leaves out its yarns, their shadows and their sheen.

    python examples/10_cloth_beside_its_mean.py [FOLDER] [PIXELS] [TEXELS]

The cloth is made up and traced yarn by yarn at 21 wavelengths, then imported as a measured one would be. Takes minutes.
"""

import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from metamer import Catalogue, import_sources, load_scene, render
from metamer.benchmarks.synthetic_btf.dyes import dyed
from metamer.benchmarks.synthetic_btf.samples import woven
from metamer.materials.btf.hemisphere import Hemisphere
from metamer.materials.formats.btf_names import directions_of
from metamer.materials.formats.btf_writer import write_btf
from metamer.spectral.formats.import_options import ImportOptions

SCENE = Path(__file__).parent / "showroom" / "twill.toml"
NM = np.arange(380.0, 781.0, 20.0)
RINGS = [(0, 0), *((theta, phi) for theta, step in ((25, 60), (50, 30), (72, 30)) for phi in range(0, 360, step))]


def measured(folder: Path, texels: int) -> None:
    """Write the images of all views and lights, and a table with the mean of those lit at 50 degrees."""
    warp, weft = (dyed(name, np.linspace(0.5, 1.4, 6)).resampled(NM) for name in ("cochineal", "walnut"))
    directions = Hemisphere(directions_of(RINGS))
    images = woven(2, texels, yarns=8, warp=warp, weft=weft).images(directions, directions)
    (folder / "twill").mkdir(parents=True)
    write_btf(folder / "twill", images, True, [])
    lit = images.values[0, [theta == 50 for theta, _ in RINGS]].mean(axis=(0, 1, 2))
    mean = np.pi * lit / np.cos(np.radians(50.0))
    np.savetxt(folder / "mean.csv", np.c_[NM, mean], "%.5f", ",", header="nm,twill", comments="")


def main(folder: Path, pixels: int, texels: int) -> None:
    warnings.simplefilter("ignore")  # notes on the booth
    measured(folder, texels)
    linear = ImportOptions(encoding="linear", white=(1.0,), includes_cosine=True)
    import_sources([folder / "twill"], folder / "catalogue", answer=linear)
    import_sources([folder / "mean.csv"], folder / "catalogue", answer=ImportOptions("reflectance", "fraction"))
    catalogue, scene = Catalogue.open(folder / "catalogue"), load_scene(SCENE)
    large, small = (
        replace(scene, cameras=(replace(scene.camera(), width=width, height_px=width * 9 // 16),))
        for width in (pixels, min(pixels, 64))
    )
    render(large, catalogue).write(folder / "twill.png")
    found, truth = render(small, catalogue), render(small, catalogue, reference=True)
    off = found.difference(truth)
    print(f"twill: ΔE94 mean {off.mean:.2f}, p95 {off.p95:.2f}")


if __name__ == "__main__":
    where, *sizes = (*sys.argv[1:], *("twill", "1280", "48")[len(sys.argv) - 1 :])
    main(Path(where), *map(int, sizes))
