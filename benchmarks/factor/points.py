"""Speed against error: one point a configuration of spectra, rank, frame or precision.

What the spectra are written in, the rank and the frame are judged on the sphere protocol. What precision costs is
judged on what the renderer draws: spheres under the same lights, with factors uploaded in 32 or 16 bits, against the
rays of the reference.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float

from ...materials.core.axes import Frame
from ...materials.core.brdf import Brdf
from ...materials.core.protocol import SphereProtocol, sphere_protocol
from ...materials.factored.pack import FactorPack
from ...materials.fitting.fit import Fit, fit
from ...materials.fitting.half_precision import rounded_to_half
from ...spectral.basis import SpectralBasis
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.upsampling import xyz_from_rgb
from ..basis import point_sampled, stage
from ..timing import timed
from .scenes import picture_statistics, reference_xyz, rendered_xyz
from .sphere import errors_by_light, folded_xyz, pack_folds
from .timing import Stopwatch

SIZES = (3, 5, 8, 12)
STEPS_NM = (5, 10, 20)
_PIXELS, _PICTURE_PIXELS = 128, 96


@dataclass(frozen=True, eq=False)
class FittedPoint:
    """A surface's own packs and the seconds that they took; `single` are the same before they were rounded to half."""

    fit: Fit
    seconds: float
    single: tuple[FactorPack, ...]


@dataclass(frozen=True)
class FitChoice:
    """Choice of fits of one surface beside its own: numbers of terms for each lobe, and frames alone."""

    ranks: tuple[int, ...]
    frames: tuple[Frame, ...]
    frame_rank: int


EVERYTHING = FitChoice((1, 2, 4, 8, 16), ("io", "hd"), 16)
# A coat that nobody tells from the original by two terms a lobe.
COAT = FitChoice((1, 2), ("io", "hd"), 16)
# Ranks of methods that take minutes to fit.
SLOW = FitChoice((2, 8), ("hd",), 12)
# The same of one whose own packs have eight terms.
SLOW_OF_EIGHT = FitChoice((2,), ("hd",), 12)
#: Surfaces that points are measured for: matt, glossy and anisotropic, then one of each family of measured data.
POINT_CASES: dict[str, FitChoice] = {
    "oren-nayar-0.52": EVERYTHING,
    "ashikhmin-shirley-32": COAT,
    "ashikhmin-shirley-1-8": SLOW_OF_EIGHT,
    "blue-metallic-paint": EVERYTHING,
    "mystique": SLOW,
    "cc_iris_purple_gem_rgb": SLOW,
}

Weights = list[Float[np.ndarray, "_ 3"]]


@dataclass(frozen=True, eq=False)
class _Configuration:
    """`weights(light)`: XYZ (R,3) of every pack's terms. `carried`: wavelengths taken to the pixel, None if folded."""

    kind: str
    name: str
    packs: tuple[FactorPack, ...]
    seconds: float
    weights: Callable[[str], Weights]
    carried: Float[np.ndarray, " L"] | None = None


def case_points(
    case: str,
    brdf: Brdf,
    fitted: FittedPoint,
    stopwatch: Stopwatch,
    lights: Sequence[str],
    progress: Callable[[str], None],
    choice: FitChoice = EVERYTHING,
) -> list[dict]:
    """Return every configuration of one surface: seconds to fit, milliseconds a megapixel and ΔE94 under each light.

    `fitted`: the packs that the spectral configurations share, and how long they took. Each point has `case`, `kind`,
    `configuration`, `rank`, `fit_seconds`, `ms_per_megapixel` and `delta_e94` by light.
    """
    points = precision_points(case, brdf, fitted, stopwatch, lights, _PICTURE_PIXELS, progress)
    protocol = sphere_protocol(_PIXELS, brdf.isotropic)
    reference = protocol.references(brdf, lights)
    drawn = {}
    for configuration in _configurations(brdf, fitted, protocol, choice):
        packs = configuration.packs
        if configuration.carried is not None:
            milliseconds = stopwatch.spectral_milliseconds(packs, configuration.carried)
        else:
            # Folded packs cost the same whatever their spectra were written in.
            milliseconds = drawn.setdefault(id(packs), None) or stopwatch.milliseconds(packs)
            drawn[id(packs)] = milliseconds
        sample = folded_xyz(packs, protocol, [configuration.weights(light) for light in lights])
        found = errors_by_light(protocol, lights, reference, sample)
        name, rank = configuration.name, sum(pack.rank for pack in packs)
        points.append(_point(case, configuration.kind, name, rank, configuration.seconds, milliseconds, found))
        progress(point_words(points[-1]))
    return points


def precision_points(
    case: str,
    brdf: Brdf,
    fitted: FittedPoint,
    stopwatch: Stopwatch,
    lights: Sequence[str],
    pixels: int,
    progress: Callable[[str], None],
) -> list[dict]:
    """Factors as the renderer is given them: single, and rounded to half with every column's largest value 1."""
    found, seconds = fitted.fit, fitted.seconds
    spectra = {light: illuminant(light) for light in lights}
    reference = reference_xyz(brdf, spectra, pixels)
    points = []
    for name in ("single", "half"):
        packs = fitted.single if name == "single" else tuple(map(rounded_to_half, found.fast.packs))
        pictures = rendered_xyz(stopwatch.renderer, packs, spectra, pixels)
        errors = {
            light: picture_statistics(reference[index], pictures[index], spectrum)
            for index, (light, spectrum) in enumerate(spectra.items())
        }
        points.append(_point(case, "precision", name, found.rank, seconds, stopwatch.milliseconds(packs), errors))
        progress(point_words(points[-1]))
    return points


def _point(
    case: str, kind: str, name: str, rank: int, seconds: float, milliseconds: float, delta_e94: dict[str, dict]
) -> dict:
    return {
        "case": case,
        "kind": kind,
        "configuration": name,
        "rank": rank,
        "fit_seconds": seconds,
        "ms_per_megapixel": milliseconds,
        "delta_e94": delta_e94,
    }


def point_words(point: dict) -> str:
    """Return a point as a line of progress."""
    p99 = ", ".join(f"{light} {found['p99']:.2f}" for light, found in point["delta_e94"].items())
    return f"    {point['kind']}: {point['configuration']}: ΔE94 p99 {p99}"


def _configurations(
    brdf: Brdf, fitted: FittedPoint, protocol: SphereProtocol, choice: FitChoice
) -> Iterator[_Configuration]:
    found, seconds = fitted.fit, fitted.seconds
    packs = found.fast.packs

    def exact(packs: tuple[FactorPack, ...]) -> Callable[[str], Weights]:
        return lambda light: pack_folds(packs, protocol, light)

    yield _Configuration("spectra", "RGB", packs, seconds, lambda light: _rgb(packs, protocol, light))
    for step in STEPS_NM:
        grid = np.arange(380.0, 781.0, step)
        yield _Configuration(
            "spectra", f"{step} nm", packs, seconds, lambda light, grid=grid: _sampled(packs, light, grid), grid
        )
    on = stage()
    for name, make in (("Peercy", SpectralBasis.peercy), ("balanced", SpectralBasis.balanced)):
        for size in SIZES:
            basis, more = timed(partial(make, on.reflectances, on.columns, size))
            projected, again = timed(lambda basis=basis: tuple(pack.in_basis(basis) for pack in packs))
            yield _Configuration("spectra", f"{name} {size}", packs, seconds + more + again, exact(projected))
    for rank in choice.ranks:
        yield _fitted("ranks", f"at most {rank} a lobe", brdf, (rank,), None, exact)
    for frame in choice.frames:
        yield _fitted("frames", f"{frame} alone, {choice.frame_rank}", brdf, (choice.frame_rank,), frame, exact)


def _fitted(
    kind: str,
    name: str,
    brdf: Brdf,
    ranks: tuple[int, ...],
    frame: Frame | None,
    exact: Callable[[tuple[FactorPack, ...]], Callable[[str], Weights]],
) -> _Configuration:
    # A budget that nothing meets, so that the rank is the one asked for.
    found, seconds = timed(lambda: fit(brdf, budget=1e-6, ranks=ranks, frame=frame))
    return _Configuration(kind, name, found.fast.packs, seconds, exact(found.fast.packs))


def _rgb(packs: tuple[FactorPack, ...], protocol: SphereProtocol, light: str) -> Weights:
    """Linear sRGB under D65, multiplied by the light's RGB: what most tools do."""
    grid, to_xyz = packs[0].palette.wavelengths_nm, xyz_from_rgb()
    d65, other = (np.linalg.solve(to_xyz, protocol.under(it).weights(grid).sum(axis=0)) for it in ("D65", light))
    found = pack_folds(packs, protocol, "D65")
    return [np.linalg.solve(to_xyz, terms.T).T * (other / d65) @ to_xyz.T for terms in found]


def _sampled(packs: tuple[FactorPack, ...], light: str, grid: Float[np.ndarray, " L"]) -> Weights:
    """Return the plain sum over one grid: light, observer and surface read off at its wavelengths only."""
    weights = np.pi * point_sampled(observer("1931_2"), light, grid).T
    basis = SpectralBasis.sampled(grid)
    return [pack.in_basis(basis).palette.values[0] @ weights for pack in packs]
