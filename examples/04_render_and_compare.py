"""A sphere, rendered from factor packs and by the slow truth, and how far apart the two pictures are in ΔE94.

Writes picture.png (for a display) and picture.exr (linear XYZ) to the folder given, or to a temporary one.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from metamer.calibration.statistics import delta_e_map, delta_e_statistics
from metamer.lighting.camera import Camera
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.reference import reference_image
from metamer.lighting.scene import Part, Scene
from metamer.lighting.shapes import sphere
from metamer.materials.analytic.ashikhmin_shirley import AshikhminShirley
from metamer.materials.fitting.fit import fit
from metamer.spectral.formats.csv import read_csv_spectra
from metamer.spectral.formats.xyz_exr import write_xyz_exr
from metamer.spectral.illuminants import illuminant
from metamer.spectral.image import ColourImage
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM
from metamer.viewer.display import DisplayTransform
from metamer.viewer.png import write_png
from metamer.viewer.software import SoftwareRenderer

CHIPS = Path(__file__).parent.parent / "catalogs" / "shipped" / "spectra" / "munsell_nist_cqs9.csv"


def main(folder: Path) -> None:
    blue = read_csv_spectra(CHIPS)["7-5pb-4-12"].resampled(NM)
    paint = AshikhminShirley(blue, Spectrum.sampled(NM, np.full(NM.size, 0.04)), 60.0, 60.0)
    lamp = DirectionalLight((1.0, 1.0, 2.0), illuminant("FL11"), illuminance_lux=1000.0)
    camera = Camera(projection="orthographic", width=96, height_px=96, samples=2)
    scene = Scene((Part("ball", sphere(4), "paint/blue"),), (lamp,), (camera,), observer("1931_2"))

    with SoftwareRenderer() as renderer:
        xyz, coverage = renderer.render(scene, camera, {"paint/blue": fit(paint, pixels=48).packs})
    truth, seen = reference_image(scene, camera, {"paint/blue": paint})

    white = scene.adopted_white()
    difference = delta_e_map(truth, xyz, white, np.minimum(coverage, seen))
    figures = delta_e_statistics(difference)
    print(f"ΔE94 over {figures.pixels} pixels under FL11: mean {figures.mean:.3f},", end=" ")
    print(f"p95 {figures.p95:.3f}, p99 {figures.p99:.3f}, max {figures.max:.3f}")

    folder.mkdir(parents=True, exist_ok=True)
    picture, display = ColourImage(xyz, "xyz", white), DisplayTransform()
    rgb, notes = display.encode(picture, coverage, 0.2 * white)
    write_png(folder / "picture.png", rgb, display=display.display)
    write_xyz_exr(folder / "picture.exr", picture, coverage, {"illuminant": "FL11"})
    print(*notes, f"Written to {folder}: picture.png, picture.exr", sep="\n")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp(prefix="metamer-")))
