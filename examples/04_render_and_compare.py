"""A sphere, rendered from factor packs and by the slow truth, and how far apart the two pictures are in ΔE94.

Writes picture.png (for a display) and picture.exr (linear XYZ) to the folder given, or to a temporary one.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from metamer import Camera, DirectionalLight, Part, Picture, Scene, Spectrum, illuminant, observer
from metamer.calibration.report.statistics import delta_e_map, delta_e_statistics
from metamer.lighting.mesh.shapes import sphere
from metamer.lighting.reference.reference import reference_image
from metamer.materials.analytic.ashikhmin_shirley import AshikhminShirley
from metamer.materials.fitting.fit import fit
from metamer.spectral.formats.csv import read_csv_spectra
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM
from metamer.viewer.software.backend import software_session

CHIPS = Path(__file__).parent.parent / "catalogs" / "shipped" / "spectra" / "munsell_nist_cqs9.csv"


def main(folder: Path) -> None:
    blue = read_csv_spectra(CHIPS)["7-5pb-4-12"].resampled(NM)
    paint = AshikhminShirley(blue, Spectrum.sampled(NM, np.full(NM.size, 0.04)), 60.0, 60.0)
    lamp = DirectionalLight((1.0, 1.0, 2.0), illuminant("FL11"), illuminance_lux=1000.0)
    camera = Camera(projection="orthographic", width=96, height_px=96, samples=2)
    scene = Scene((Part("ball", sphere(4), "paint/blue"),), (lamp,), (camera,), observer("1931_2"))

    with software_session() as renderer:
        xyz, coverage = renderer.render(scene, camera, {"paint/blue": fit(paint, pixels=48).fast})
        picture = Picture(scene, camera, xyz, coverage, renderer.made_by)
    truth, seen = reference_image(scene, camera, {"paint/blue": paint})

    difference = delta_e_map(truth, picture.xyz, picture.white, np.minimum(picture.coverage, seen))
    figures = delta_e_statistics(difference)
    print(f"ΔE94 over {figures.pixels} pixels under FL11: mean {figures.mean:.3f},", end=" ")
    print(f"p95 {figures.p95:.3f}, p99 {figures.p99:.3f}, max {figures.max:.3f}")

    folder.mkdir(parents=True, exist_ok=True)
    picture.write(folder / "picture.exr")
    print(*picture.write(folder / "picture.png"), f"Written to {folder}: picture.png, picture.exr", sep="\n")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp(prefix="metamer-")))
