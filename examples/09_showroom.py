"""Pictures to look at: `showroom/` and a metameric pair, 1280 pixels wide; ΔE94 beside references of at most 64.

    python examples/09_showroom.py [FOLDER] [PIXELS] [SCENE ...]

Materials are those of the default catalogue. Takes minutes: references, and light between surfaces, which is kept.
"""

import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from metamer import Catalogue, Scene, delta_e, illuminant, import_sources, load_scene, observer, render
from metamer.spectral.formats.csv import read_csv_spectra
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

HERE = Path(__file__).parent
CHIPS = HERE.parent / "catalogs" / "shipped" / "spectra" / "munsell_nist_cqs9.csv"


def wide(scene: Scene, pixels: int) -> Scene:
    height = max(1, round(pixels * scene.camera().height_px / scene.camera().width))
    return replace(scene, cameras=(replace(scene.camera(), width=pixels, height_px=height),))


def metameric_pair(folder: Path) -> Catalogue:
    """Two paints of one colour under D65: one differs by what the observer does not see of a ripple."""
    paint = read_csv_spectra(CHIPS)["5p-5-10"].resampled(NM).samples
    seen = observer("1931_2").weights(illuminant("D65"), NM)
    ripple = 0.16 * np.cos(2 * np.pi * (NM - 380) / 110)
    other = paint + ripple - seen.T @ np.linalg.solve(seen @ seen.T, seen @ ripple)
    np.savetxt(folder / "pair.csv", np.c_[NM, paint, other], "%.6f", ",", header="nm,master,other", comments="")
    import_sources([folder / "pair.csv"], folder / "pair", answer=ImportOptions("reflectance", "fraction"))
    return Catalogue.open(folder / "pair")


def main(folder: Path, pixels: int, *names: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore")  # notes on the booth
    pair, catalogue = metameric_pair(folder), Catalogue.open()
    scene = wide(load_scene(HERE / "showroom" / "pair.toml", pair), pixels)
    for lamp in ("D65", "A", "FL11", "LED-B3"):
        render(scene, pair, illuminant=lamp).write(folder / f"pair-{lamp}.png")
        print(f"pair, {lamp}: ΔE94 {delta_e(pair['pair/master'].lab(lamp), pair['pair/other'].lab(lamp)):.2f}")
    for name in names or ("gloss", "metals", "corner"):
        scene = load_scene(HERE / "showroom" / f"{name}.toml", catalogue)
        render(wide(scene, pixels), catalogue).write(folder / f"{name}.png")
        found, truth = (render(wide(scene, min(pixels, 64)), catalogue, reference=slow) for slow in (False, True))
        off = found.difference(truth)
        print(f"{name}: ΔE94 mean {off.mean:.2f}, p95 {off.p95:.2f}")


if __name__ == "__main__":
    where, size, *scenes = (*sys.argv[1:], *("showroom", "1280")[len(sys.argv) - 1 :])
    main(Path(where), int(size), *scenes)
