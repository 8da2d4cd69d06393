"""A metallic paint, read at six angles and imported as one material, on a panel: light, mid and dark as it turns away.

    python examples/11_panel_that_flops.py [FOLDER] [PIXELS]

The readings are made up: a blue base under flakes whose tilts are Gaussian. Takes a minute, most of it for the fit.
"""

import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from metamer import Catalogue, import_sources, load_scene, render
from metamer.spectral.formats.import_options import ImportOptions

SCENE = Path(__file__).parent / "showroom" / "flop.toml"
NM = np.arange(380.0, 781.0, 10.0)
ANGLES = np.array([-15, 15, 25, 45, 75, 110])  # from the mirror, lit at 45 degrees


def readings() -> np.ndarray:
    """Radiance factors (wavelengths, angles): a flake leans by half of what lies between the rays within the coat."""
    lamp, eye = (np.degrees(np.arcsin(np.sin(np.radians(angle)) / 1.5)) for angle in (45.0, 45.0 - ANGLES))
    flakes = np.exp(-(((lamp - eye) / 2.0 / 11.0) ** 2))
    base = 0.02 + 0.1 * np.exp(-0.5 * ((NM - 460.0) / 40.0) ** 2)
    return base[:, None] + np.outer(1.4 + 0.8 * np.exp(-0.5 * ((NM - 470.0) / 70.0) ** 2), flakes)


def main(folder: Path, pixels: int) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore")  # notes on the booth
    names = "nm," + ",".join(f"45as{angle}" for angle in ANGLES)
    np.savetxt(folder / "metallic.csv", np.c_[NM, readings()], "%.5f", ",", header=names, comments="")
    np.savetxt(folder / "floor.csv", np.c_[NM, 0.0 * NM + 0.32], "%.5f", ",", header="nm,grey", comments="")
    files, answer = (folder / "metallic.csv", folder / "floor.csv"), ImportOptions("reflectance", "fraction")
    import_sources(files, folder / "catalogue", answer=answer)
    catalogue, scene = Catalogue.open(folder / "catalogue"), load_scene(SCENE)
    print(f"reconstructed: {catalogue['metallic/metallic'].provenance.kind}")
    large, small = (
        replace(scene, cameras=(replace(scene.camera(), width=width, height_px=width * 9 // 16),))
        for width in (pixels, min(pixels, 64))
    )
    render(large, catalogue).write(folder / "flop.png")
    found, truth = render(small, catalogue), render(small, catalogue, reference=True)
    off = found.difference(truth)
    print(f"flop: ΔE94 mean {off.mean:.2f}, p95 {off.p95:.2f}")


if __name__ == "__main__":
    where, size = (*sys.argv[1:], *("flop", "1280")[len(sys.argv) - 1 :])
    main(Path(where), int(size))
