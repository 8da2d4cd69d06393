"""BTFs as folders of images that other programs read: OpenEXR under UBO2003's names, linear, in colours or in spectra.

A number is pi f_r cos(theta_i): 1 of a perfect white diffuser that is lit along its normal.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.formats.exr import write_exr
from ...spectral.formats.spectral_exr import write_spectral_texture
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.upsampling import xyz_from_rgb
from ..btf.hemisphere import Hemisphere
from ..btf.images import BtfImages

#: The file that says how the images are to be read again.
ABOUT = "about-these-images.txt"


def write_btf(
    folder: Path,
    images: BtfImages,
    spectral: bool,
    said: list[str],
    heard: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[str, ...]:
    """Write every image; notes on what they are.

    folder : exists and is empty. spectral : one channel per wavelength; else linear sRGB under D65, which is complete
    for a BTF in RGB. said : further lines of `ABOUT`. heard : receives the numbers of images written and in total.

    Raises
    ------
    InputError : an image cannot be read, or written.
    """
    views, lights = _degrees(images.views), _degrees(images.lights)
    total, grid = len(views) * len(lights), images.basis.wavelengths_nm
    to_rgb = np.linalg.solve(xyz_from_rgb(), observer("1931_2").weights(illuminant("D65"), grid)).T
    to_rgb = to_rgb if images.basis.is_sampled else images.basis.synthesis.T @ to_rgb
    for view, (theta, phi) in enumerate(views):
        for light, (tl, pl) in enumerate(lights):
            number = view * len(lights) + light + 1
            name = f"{number:05d} tl{_number(tl)} pl{_number(pl)} tv{_number(theta)} pv{_number(phi)}.exr"
            values = np.pi * images.image(view, light).astype(np.float64)
            if spectral:
                write_spectral_texture(folder / name, images.basis.reconstruct(values), grid, False)
            else:
                write_exr(folder / name, {}, _channels(values @ to_rgb))
            heard(number, total)
    width = [] if images.texel_mm is None else [f"--texel-mm {images.texel_mm:g}"]
    words = ["metamer catalogue import FOLDER --encoding linear --white 1 --includes-cosine yes", *width]
    kind = "T.* are reflectances by wavelength, R, G and B a preview" if spectral else "linear sRGB, of D65"
    lines = [f"{total} images of {images.width} x {images.height} texels: {kind}"]
    lines.append(f"to read them again: {' '.join(words)}")
    (folder / ABOUT).write_text("\n".join([*lines, *said, ""]), encoding="utf-8")
    return f"{total} images, linear, a perfect white diffuser is 1; {ABOUT} says how to read them again", kind


def _channels(rgb: Float[np.ndarray, "H W 3"]) -> dict[str, np.ndarray]:
    return {name: rgb[..., place] for place, name in enumerate("RGB")}


def _degrees(directions: Hemisphere) -> list[tuple[float, float]]:
    """Convert directions to theta and phi, to a thousandth of a degree.

    Raises
    ------
    InputError : two directions whose names would be the same.
    """
    x, y, z = directions.directions.T
    theta, phi = np.degrees(np.arctan2(np.hypot(x, y), z)), np.degrees(np.arctan2(y, x)) % 360.0
    found = [(float(a), float(b)) for a, b in zip(np.round(theta, 3), np.round(phi, 3) % 360.0, strict=True)]
    if len(set(found)) < len(found):
        raise InputError("directions too close for names", field="directions", expected="0.001 degrees between them")
    return found


def _number(degrees: float) -> str:
    """Format an angle with three digits, as in UBO2003, or more if necessary."""
    whole = f"{degrees:07.3f}".rstrip("0").rstrip(".")
    return whole if "." in whole else f"{round(degrees):03d}"
