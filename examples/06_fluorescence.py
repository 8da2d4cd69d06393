"""A surface that turns blue light into green, rendered under three lights, and what a plain reflectance would miss.

A fluorescent surface is a Donaldson matrix: radiance out, at every wavelength, for light in at every other. It folds
with each light into three numbers, so that its picture costs what any matt one costs. Takes a bispectral OpenEXR, whose
first pixel it shows, or a dye made up here; writes one picture a light to the folder given, or to a temporary one.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from metamer.lighting.camera import Camera
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.mesh.shapes import sphere
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.scene import Part, Scene
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.spectral.bispectral import fluorophore
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.formats.spectral_exr import read_spectral_exr
from metamer.spectral.formats.xyz_exr import write_xyz_exr
from metamer.spectral.illuminants import illuminant
from metamer.spectral.image import ColourImage
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum
from metamer.viewer.software.backend import software_session

NM = np.arange(300.0, 781.0, 10.0)


def main(folder: Path, file: Path | None = None) -> None:
    base = Spectrum.sampled(NM, 0.1 + 0.5 / (1.0 + np.exp((500.0 - NM) / 15.0)))
    absorbed, sent = (np.exp(-(((NM - nm) / width) ** 2)) for nm, width in ((400.0, 60.0), (520.0, 25.0)))
    dye = read_spectral_exr(file).bispectral(0, 0) if file else fluorophore(base, 0.6 * absorbed, sent, 0.9)
    note, eye = FluorescentLambert(dye), observer("1931_2")
    nm, lights = np.arange(300.0, 831.0), {"D65": illuminant("D65"), "A": illuminant("A")}
    lights["UV-free"] = Spectrum.sampled(nm, np.where(nm <= 400, 0, lights["D65"].resampled(nm).samples), "emission")
    lamp = DirectionalLight((1.0, 1.0, 2.0), lights["D65"], illuminance_lux=1000.0)
    camera = Camera(projection="orthographic", width=96, height_px=96, samples=2)
    scene = Scene((Part("ball", sphere(4), "note"),), (lamp,), (camera,), eye)
    truth = reference_images(scene, None, {"note": note}, tuple(lights.values()))
    with software_session() as renderer:
        pictures = renderer.render_many(scene, None, {"note": note.own_form()}, tuple(lights.values()))
    folder.mkdir(parents=True, exist_ok=True)
    for (name, light), (xyz, coverage), exact in zip(lights.items(), pictures, truth.xyz, strict=True):
        white, lit = eye.white(light), exact[..., 1] > 0.02
        off = delta_e_xyz(exact[lit], xyz[lit].astype(np.float64), white)
        missed = delta_e_xyz(dye.fold(light, eye), dye.without_emission().fold(light, eye), white)
        print(
            f"{name:8} Y {dye.fold(light, eye)[1]:.3f}   ΔE94 of the picture, p99 {np.percentile(off, 99):.3f}",
            end="   ",
        )
        print(f"of a plain reflectance {missed:.2f}")
        write_xyz_exr(folder / f"{name}.exr", ColourImage(xyz, "xyz", white), coverage, {"illuminant": name})


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp(prefix="metamer-")), *map(Path, sys.argv[2:3]))
