"""Speed against error: one point a configuration of spectra, rank, frame or precision."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ..calibration.basis_benchmark import point_sampled, stage
from ..materials.brdf import Brdf, Frame, Lobe
from ..materials.cp import balanced
from ..materials.factors import FactorPack
from ..materials.fit import Fit, fit
from ..materials.protocol import SphereProtocol, sphere_protocol
from ..spectral.basis import SpectralBasis
from ..spectral.observers import observer
from .factor_sphere import brdf_xyz, folded_xyz, folds, statistics, under
from .factor_timing import Stopwatch

#: Isotropic surfaces, one matt and one glossy: what fits in seconds at every rank.
POINT_CASES = ("oren-nayar-0.52", "ashikhmin-shirley-32")
SIZES = (3, 5, 8, 12)
RANKS = (1, 2, 4, 8, 16)
FRAMES: tuple[Frame, ...] = ("io", "hd")
FRAME_RANK = 16
STEPS_NM = (5, 10, 20)
# IEC 61966-2-1 primaries, as in the benchmark of bases.
_XYZ_FROM_RGB = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
_PIXELS = 128

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


@dataclass(frozen=True, eq=False)
class OneFrame(Brdf):
    """A BRDF kept whole: one lobe, in the frame that is asked for."""

    brdf: Brdf
    frame: Frame

    @property
    def wavelengths_nm(self) -> Float[np.ndarray, " L"]:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.brdf.wavelengths_nm

    @property
    def isotropic(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.brdf.isotropic

    def eval(
        self, wi: Float[np.ndarray, "*#batch 3"], wo: Float[np.ndarray, "*#batch 3"]
    ) -> Float[np.ndarray, "... L"]:
        """f_r of the whole."""
        return self.brdf.eval(wi, wo)

    def lobes(self) -> tuple[Lobe, ...]:
        """Itself, in the one frame."""
        return (Lobe(self.frame, self),)


def case_points(
    case: str,
    brdf: Brdf,
    fitted: tuple[Fit, float],
    stopwatch: Stopwatch,
    lights: Sequence[str],
    progress: Callable[[str], None],
    ranks: Sequence[int] = RANKS,
    pixels: int = _PIXELS,
) -> list[dict]:
    """Every configuration of one surface: seconds to fit, milliseconds a megapixel and ΔE94 under each light.

    `fitted`: the packs that the spectral configurations share, and how long they took. Each point has `case`, `kind`,
    `configuration`, `rank`, `fit_seconds`, `ms_per_megapixel` and `delta_e94` by light.
    """
    protocol = sphere_protocol(pixels, brdf.isotropic)
    reference = brdf_xyz(brdf, protocol, lights)
    points, drawn = [], {}
    for configuration in _configurations(brdf, fitted, protocol, ranks):
        packs = configuration.packs
        if configuration.carried is not None:
            milliseconds = stopwatch.spectral_milliseconds(packs, configuration.carried)
        else:
            # Folded packs cost the same whatever their spectra were written in.
            milliseconds = drawn.setdefault(id(packs), None) or stopwatch.milliseconds(packs)
            drawn[id(packs)] = milliseconds
        sample = folded_xyz(packs, protocol, [configuration.weights(light) for light in lights])
        errors = [under(protocol, light).compare(reference[index], sample[index]) for index, light in enumerate(lights)]
        points.append(
            {
                "case": case,
                "kind": configuration.kind,
                "configuration": configuration.name,
                "rank": sum(pack.rank for pack in packs),
                "fit_seconds": configuration.seconds,
                "ms_per_megapixel": milliseconds,
                "delta_e94": {light: statistics(error) for light, error in zip(lights, errors, strict=True)},
            }
        )
        p99 = ", ".join(f"{light} {error.p99:.2f}" for light, error in zip(lights, errors, strict=True))
        progress(f"    {configuration.kind}: {configuration.name}: ΔE94 p99 {p99}")
    return points


def _configurations(
    brdf: Brdf, fitted: tuple[Fit, float], protocol: SphereProtocol, ranks: Sequence[int]
) -> Iterator[_Configuration]:
    found, seconds = fitted
    packs = found.packs

    def exact(packs: tuple[FactorPack, ...]) -> Callable[[str], Weights]:
        return lambda light: folds(packs, protocol, light)

    yield _Configuration("precision", "single", *_rounded(packs, np.float32, seconds, exact))
    yield _Configuration("precision", "half", *_rounded(packs, np.float16, seconds, exact))
    yield _Configuration("spectra", "RGB", packs, seconds, lambda light: _rgb(packs, protocol, light))
    for step in STEPS_NM:
        grid = np.arange(380.0, 781.0, step)
        yield _Configuration(
            "spectra", f"{step} nm", packs, seconds, lambda light, grid=grid: _sampled(packs, light, grid), grid
        )
    on = stage()
    for name, make in (("Peercy", SpectralBasis.peercy), ("balanced", SpectralBasis.balanced)):
        for size in SIZES:
            start = time.perf_counter()
            basis = make(on.reflectances, on.columns, size)
            projected = tuple(pack.in_basis(basis) for pack in packs)
            taken = seconds + time.perf_counter() - start
            weights = exact(projected)
            yield _Configuration("spectra", f"{name} {size}", packs, taken, weights)
    for rank in ranks:
        yield _fitted("ranks", f"at most {rank} a lobe", brdf, (rank,), exact)
    for frame in FRAMES:
        yield _fitted("frames", f"{frame} alone, {FRAME_RANK}", OneFrame(brdf, frame), (FRAME_RANK,), exact)


def _fitted(
    kind: str,
    name: str,
    brdf: Brdf,
    ranks: tuple[int, ...],
    exact: Callable[[tuple[FactorPack, ...]], Callable[[str], Weights]],
) -> _Configuration:
    start = time.perf_counter()
    # A budget that nothing meets, so that the rank is the one asked for.
    packs = fit(brdf, budget=1e-6, ranks=ranks).packs
    return _Configuration(kind, name, packs, time.perf_counter() - start, exact(packs))


def _rounded(
    packs: tuple[FactorPack, ...],
    dtype: type,
    seconds: float,
    exact: Callable[[tuple[FactorPack, ...]], Callable[[str], Weights]],
) -> tuple[tuple[FactorPack, ...], float, Callable[[str], Weights]]:
    """Factors stored in fewer bits, of balanced length so that none leaves the range; spectra stay as they are."""
    rounded = []
    for pack in packs:
        *factors, spectral = balanced([*pack.factors, pack.spectral.T])
        factors = tuple(factor.astype(dtype).astype(float) for factor in factors)
        rounded.append(replace(pack, factors=factors, spectral=spectral.T))
    return tuple(rounded), seconds, exact(tuple(rounded))


def _rgb(packs: tuple[FactorPack, ...], protocol: SphereProtocol, light: str) -> Weights:
    """Linear sRGB under D65, multiplied by the light's RGB: what most tools do."""
    grid = packs[0].basis.wavelengths_nm
    d65, other = (
        np.linalg.solve(_XYZ_FROM_RGB, under(protocol, it).weights(grid).sum(axis=0)) for it in ("D65", light)
    )
    found = folds(packs, protocol, "D65")
    return [np.linalg.solve(_XYZ_FROM_RGB, terms.T).T * (other / d65) @ _XYZ_FROM_RGB.T for terms in found]


def _sampled(packs: tuple[FactorPack, ...], light: str, grid: Float[np.ndarray, " L"]) -> Weights:
    """The plain sum over one grid: light, observer and surface read off at its wavelengths only."""
    weights = np.pi * point_sampled(observer("1931_2"), light, grid).T
    basis = SpectralBasis.sampled(grid)
    return [pack.in_basis(basis).spectral @ weights for pack in packs]
