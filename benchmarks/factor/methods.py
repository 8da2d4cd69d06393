"""The paper's own rows: packs of four terms on one table in one frame, by each of its methods, until they are as good.

Schwenk 2010, section 3.3: incremental packs (each fitted to what the ones before it have left) and, as it considers
and rejects for want of memory, all terms found together; "refitted" stands between. Spectra are written in Peercy's
basis of the surface and the lights themselves, eight coefficients, which is exact here: only directions are compared.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...materials.core.axes import Axis, Frame
from ...materials.core.brdf import Brdf
from ...materials.core.protocol import sphere_protocol
from ...materials.factored.pack import FactoredBrdf, FactorPack
from ...materials.fitting.brdf_table import node_directions, tabulate
from ...materials.fitting.cp import absorbed
from ...materials.fitting.decompose import METHODS, PACK, decompose_compressed
from ...materials.fitting.grids import filled
from ...materials.fitting.tucker import compressed
from ...spectral.basis import SpectralBasis
from ...spectral.illuminants import illuminant
from ...spectral.observers import observer
from ...spectral.palette import Palette
from .points import point_words
from .sphere import errors_by_light
from .timing import Stopwatch

COEFFICIENTS = 8
_RIGHT, _TURN = 0.5 * np.pi, 2.0 * np.pi


@dataclass(frozen=True)
class Effort:
    """Effort spent on the paper's methods.

    packs : numbers of packs that are tried in the frame that the paper took, and up to `other` in the other frame,
    where cores are larger. isotropic, anisotropic : sizes of the grids, polar angles first.
    """

    packs: tuple[int, ...]
    other: int
    isotropic: tuple[int, ...]
    anisotropic: tuple[int, ...]


#: Half the paper's resolution.
QUICK = Effort((1, 2, 4, 8), 4, (45, 45, 90), (23, 16, 17, 17))
#: The paper's grids, 1 degree and the azimuth 2; those of anisotropic surfaces are thinned to fit into little memory.
FULL = Effort((1, 2, 4, 8, 16, 24), 8, (90, 90, 180), (45, 23, 33, 33))
# Share of the energy that compression may lose, as `decompose` has it.
_LOST = 1e-9
_PILOT = 4000


def method_points(
    case: str,
    brdf: Brdf,
    stopwatch: Stopwatch,
    lights: Sequence[str],
    progress: Callable[[str], None],
    effort: Effort = QUICK,
    pixels: int = 128,
) -> list[dict]:
    """One point a frame, method and number of packs, shaped as those of `case_points`, with `method`, `frame`, `packs`
    and the table's `relative_error` beside them. Seconds are those of table and decomposition.
    """
    protocol = sphere_protocol(pixels, brdf.isotropic)
    reference = protocol.references(brdf, lights)
    basis = _basis(brdf, lights)
    points = []
    frames: tuple[Frame, Frame] = ("io", "hd") if brdf.isotropic else ("hd", "io")
    for frame in frames:
        drawn: dict[int, float] = {}
        axes = grid(frame, effort.isotropic if brdf.isotropic else effort.anisotropic)
        counts = [count for count in effort.packs if frame == frames[0] or count <= effort.other]
        for method, count, pack, seconds, relative in _decomposed(brdf, frame, axes, basis, counts):
            sample = protocol.samples(FactoredBrdf((pack,)), lights)
            if frame == "hd":
                # Its table holds the cosine already, which packs in this frame are given when they are looked up.
                sample = sample / protocol.wi[:, 2:]
            if count not in drawn:
                # The cost of a picture does not depend on how the terms were found.
                drawn[count] = stopwatch.milliseconds((pack,))
            points.append(
                {
                    "case": case,
                    "kind": "paper",
                    "configuration": f"{frame}, {method}, {count} pack{'s' if count > 1 else ''}",
                    "method": method,
                    "frame": frame,
                    "packs": count,
                    "rank": pack.rank,
                    "fit_seconds": seconds,
                    "relative_error": relative,
                    "ms_per_megapixel": drawn[count],
                    "delta_e94": errors_by_light(protocol, lights, reference, sample),
                }
            )
            progress(point_words(points[-1]))
    return points


def packs_needed(points: Sequence[dict], light: str, p99: float) -> dict[str, int | None]:
    """Find for each frame and method the least number of packs tried whose p99 is within `p99`; None where none is."""
    needed: dict[str, int | None] = {}
    for point in points:
        key = f"{point['frame']}, {point['method']}"
        enough = point["delta_e94"][light]["p99"] <= p99
        needed[key] = min(filter(None, (needed.get(key), point["packs"] if enough else None)), default=None)
    return needed


def grid(frame: Frame, sizes: Sequence[int]) -> tuple[Axis, ...]:
    """Return the table's axes, three or, of an anisotropic surface, four; frame hd is dense near the highlight
    (square-root scale), which only helps it.
    """
    if frame == "io":
        axes = (Axis("theta_i", sizes[0], _RIGHT), Axis("theta_o", sizes[1], _RIGHT))
        names = ("phi", "phi_i")
    else:
        axes = (Axis("theta_h", sizes[0], _RIGHT, "sqrt"), Axis("theta_d", sizes[1], _RIGHT))
        names = ("phi_d", "phi_h")
    if len(sizes) == 3:
        return (*axes, Axis(names[0], sizes[2], np.pi))
    return (*axes, *(Axis(name, size, _TURN, periodic=True) for name, size in zip(names, sizes[2:], strict=True)))


def _decomposed(
    brdf: Brdf, frame: Frame, axes: tuple[Axis, ...], basis: SpectralBasis, packs: Sequence[int]
) -> Iterator[tuple[str, int, FactorPack, float, float]]:
    """Method, packs, the pack of all terms, seconds (table, compression and terms) and the table's relative error."""
    start = time.perf_counter()
    table = _tabulated(brdf, frame, axes, basis)
    form = compressed(table, _LOST, 2 * PACK * max(packs))
    shared = time.perf_counter() - start
    del table
    for method in METHODS:
        for count in packs:
            start = time.perf_counter()
            found = decompose_compressed(form, PACK * count, method=method)
            *factors, spectral = absorbed(found.cp)
            pack = FactorPack(frame, axes, tuple(factors), Palette.of(spectral.T, basis))
            yield method, count, pack, shared + time.perf_counter() - start, found.relative_error


def _tabulated(brdf: Brdf, frame: Frame, axes: tuple[Axis, ...], basis: SpectralBasis) -> np.ndarray:
    """f_r cos(theta_i) in both frames, which is what the paper factored; nodes below the horizon are held."""
    table = tabulate(brdf, frame, axes, basis.analysis)
    if frame == "hd":
        table.values[:] *= np.maximum(node_directions(frame, axes)[0][..., 2:], 0.0)
    return filled(table)


def _basis(brdf: Brdf, lights: Sequence[str]) -> SpectralBasis:
    """Peercy's linear model of this surface's spectra and of what it is lit by, as in section 3.5."""
    protocol = sphere_protocol(48, brdf.isotropic)
    rows = slice(None, None, max(1, len(protocol.wi) // _PILOT))
    spectra = brdf.eval(protocol.wi[rows], protocol.wo[rows])
    eye = observer("1931_2")
    columns = np.concatenate([eye.weights(illuminant(light), brdf.wavelengths_nm) for light in lights]).T
    # Lights as long as reflectances: a highlight must not push them out.
    spectra = spectra / np.linalg.norm(spectra, axis=1).max()
    columns = columns / np.linalg.norm(columns, axis=0).min()
    return SpectralBasis.peercy(spectra, columns, COEFFICIENTS, brdf.wavelengths_nm)
