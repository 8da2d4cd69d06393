"""FLIP: the difference of two pictures that a person sees who alternates them on a display."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ..runtime.distribution import install_hint
from ..runtime.errors import InputError

#: Pixels a degree of a 0.7 m wide display of 3840 pixels at 0.7 m, which FLIP takes where nothing is said.
PIXELS_PER_DEGREE = 67.0


def flip(
    reference_srgb: Float[np.ndarray, "height width 3"],
    sample_srgb: Float[np.ndarray, "height width 3"],
    pixels_per_degree: float = PIXELS_PER_DEGREE,
) -> Float[np.ndarray, "height width"]:
    """FLIP (height, width), float32, 0 to 1, of pictures encoded in sRGB, 0 to 1, by its authors' `flip-evaluator`.

    P. Andersson et al., FLIP: a difference evaluator for alternating images, Proceedings of the ACM on Computer
    Graphics and Interactive Techniques 3, 2020, for pictures of a display (LDR).
    It is no ΔE: it filters as eyes do at a distance, and adds edges and points.

    Parameters
    ----------
    pixels_per_degree : of visual angle, which the distance of the display decides.

    Raises
    ------
    InputError : the package is not installed; other shapes, no pixel, values outside 0 to 1, or no such distance.
    """
    try:
        from flip_evaluator import evaluate  # type: ignore[import-not-found]
    except ImportError:
        raise InputError(
            "FLIP is not installed",
            found="no flip-evaluator",
            expected="the extra `flip`",
            hint=install_hint("flip"),
        ) from None
    if np.shape(reference_srgb) != np.shape(sample_srgb):
        found = f"{np.shape(reference_srgb)} and {np.shape(sample_srgb)}"
        raise InputError("images of different shapes", field="sample_srgb", found=found, expected="one shape")
    if not (np.isfinite(pixels_per_degree) and pixels_per_degree > 0.0):
        raise InputError("no distance", field="pixels_per_degree", found=pixels_per_degree, expected="a number above 0")
    reference, sample = _checked("reference_srgb", reference_srgb), _checked("sample_srgb", sample_srgb)
    viewing = {"ppd": float(pixels_per_degree)}
    found, _, _ = evaluate(reference, sample, "LDR", applyMagma=False, computeMeanError=False, parameters=viewing)
    return np.asarray(found)[..., 0]


def _checked(name: str, picture: np.ndarray) -> Float[np.ndarray, "height width 3"]:
    """Check a picture and return it as FLIP takes it, which clips in silence what lies beyond 0 and 1."""
    if picture.ndim != 3 or picture.shape[2] != 3 or not picture.size:
        raise InputError("no picture", field=name, found=f"shape {picture.shape}", expected="(height, width, 3)")
    low, high = picture.min(), picture.max()
    if not (low >= 0.0 and high <= 1.0):
        raise InputError(
            "no picture for a display",
            field=name,
            found=f"values from {low:g} to {high:g}",
            expected="sRGB, 0 to 1",
            hint="map it to the display first, and see what that clips",
        )
    return np.ascontiguousarray(picture, dtype=np.float32)
