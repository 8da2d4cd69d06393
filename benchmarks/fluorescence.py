"""Effect of fluorescence on colour, and the few numbers that carry it from surface to surface.

    python -m metamer.benchmarks.fluorescence [FILE.exr] [--json OUT.json]

FILE.exr is a bispectral image (every distinct pixel is a surface); without it two dyes made up for the purpose are
taken, the same that `metamer bench factor` draws.

All figures are ΔE94 for the 1931 2 degree observer, in CIELAB relative to each light's own white.

"Direct": the full matrix, folded with the light at its own resolution, against (a) the diagonal alone, which is what a
reflectance can say, (b) the matrix times the light read off at the matrix's own wavelengths, and (c) the operator
A^T D B put between coefficients of *reflectance* (J = 16, sampled at 1 nm), which is not what it is for. "Two
surfaces": every pair, fluorescent and ColorChecker, through A^T D B in a balanced basis of radiances and in an
orthonormal one (Peercy) of the same radiances, against the full matrices at 1 nm.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..calibration.report.text_tables import text_tables
from ..spectral.basis import SpectralBasis
from ..spectral.bispectral import Bispectral, fluorophore
from ..spectral.difference import delta_e_xyz
from ..spectral.formats.spectral_exr import read_spectral_exr
from ..spectral.illuminants import illuminant
from ..spectral.observers import observer
from ..spectral.radiance_basis import radiance_basis, radiance_operators
from ..spectral.spectrum import Spectrum
from .basis import colour_checker
from .timing import command, write_json

EYE, NM = observer("1931_2"), np.arange(360.0, 831.0)
SIZES = (3, 4, 5, 6, 8, 10, 12, 16)
#: Light without ultraviolet: D65 with nothing up to this wavelength, nm.
CUT_NM = 400.0
UV_FREE = "D65 UV-free"
UV_FREE_WORDS = f"D65 with nothing up to {CUT_NM:g} nm, and untouched from the next nanometre on"


def fluorescence_lights() -> dict[str, Spectrum]:
    """D65, A, D65 with nothing up to 400 nm, and a lamp of narrow lines."""
    grid = np.arange(300.0, 831.0)
    power = illuminant("D65").resampled(grid).samples
    cut = Spectrum.sampled(grid, np.where(grid <= CUT_NM, 0.0, power), "emission")
    return {"D65": illuminant("D65"), "A": illuminant("A"), UV_FREE: cut, "FL11": illuminant("FL11")}


def made_up() -> list[Bispectral]:
    """Two dyes on grey: blue to green, and green to orange."""
    grid = np.arange(380.0, 781.0, 10.0)
    bump = lambda centre, width: np.exp(-(((grid - centre) / width) ** 2))  # noqa: E731
    grey = Spectrum.sampled(grid, 0.1 + 0.5 / (1.0 + np.exp((500.0 - grid) / 15.0)))
    return [fluorophore(grey, 0.3 * bump(a, 40), bump(e, 25), 0.9) for a, e in ((430, 520), (490, 600))]


def surfaces_of(path: Path) -> list[Bispectral]:
    """Return the distinct pixels of a bispectral image."""
    image = read_spectral_exr(path)
    height, width = image.spectrum.samples.shape[:2]
    found: dict[bytes, Bispectral] = {}
    for row, column in np.ndindex(height, width):
        surface = image.bispectral(row, column)
        found.setdefault(surface.matrix.tobytes(), surface)
    return list(found.values())


def direct(surfaces: Sequence[Bispectral]) -> list[dict]:
    """One row a surface and light."""
    chart = colour_checker().resampled(NM).samples
    weights = {name: EYE.weights(light, NM) for name, light in fluorescence_lights().items()}
    basis = SpectralBasis.balanced(chart, np.concatenate(list(weights.values())).T, 16, NM)
    rows = []
    for number, surface in enumerate(surfaces):
        grid = surface.reflectance.wavelengths_nm
        relative = basis.bispectral_operator(surface.on(NM)) @ basis.project(np.ones(NM.size))
        for name, light in fluorescence_lights().items():
            truth, white = surface.fold(light, EYE), EYE.white(light)
            power, seen = light.resampled(grid).samples, EYE.sensitivity(grid)
            coarse = seen @ (surface.on(grid) @ power) / (seen[1] @ power)
            others = {
                "diagonal": surface.without_emission().fold(light, EYE),
                "own_grid": coarse,
                "as_reflectance": basis.fold(light, EYE) @ relative,
            }
            errors = {key: float(delta_e_xyz(truth, xyz, white)) for key, xyz in others.items()}
            rows.append({"surface": number, "light": name, "Y": float(truth[1]), **errors})
    return rows


def two_surfaces(surfaces: Sequence[Bispectral], sizes: tuple[int, ...] = SIZES) -> list[dict]:
    """One row a J: mean and worst over all pairs and lights, and worst over pairs in which one fluoresces."""
    sensitivity = EYE.sensitivity(NM)
    plain = [np.diag(patch) for patch in colour_checker().resampled(NM).samples]
    matrices = np.stack([surface.on(NM) for surface in surfaces] + plain)
    powers = np.stack([light.resampled(NM).samples for light in fluorescence_lights().values()])
    powers /= (powers @ sensitivity[1])[:, None]
    first = np.einsum("nlk,mk->mnl", matrices, powers, optimize=True)
    truth = np.einsum("cl,plk,mnk->mnpc", sensitivity, matrices, first, optimize=True)
    whites = powers @ sensitivity.T
    shines = np.arange(len(matrices)) < len(surfaces)
    either = shines[:, None] | shines

    def errors(basis: SpectralBasis) -> np.ndarray:
        operators, folded = radiance_operators(basis, matrices), sensitivity @ basis.synthesis
        seen = np.einsum("cj,pjk,mnk->mnpc", folded, operators, basis.project(first), optimize=True)
        return np.stack([delta_e_xyz(*each) for each in zip(truth, seen, whites, strict=True)])

    full = radiance_basis(matrices, powers, sensitivity, NM)
    rows = []
    for size in sizes:
        ours = errors(full.truncated(size))
        theirs = errors(SpectralBasis.peercy(first.reshape(-1, NM.size), sensitivity.T, size, NM))
        rows.append(
            {"J": size, "mean": float(ours.mean()), "max": float(ours.max())}
            | {"max_fluorescent": float(ours[:, either].max()), "peercy_max": float(theirs.max())}
        )
    return rows


def report(figures: dict) -> str:
    """Both tables as text."""
    header = ["surface and light", "Y", "diagonal only", "light on the matrix's grid", "as reflectance, J = 16"]
    keys = ("Y", "diagonal", "own_grid", "as_reflectance")
    one = [[f"{row['surface']} {row['light']}", *(f"{row[key]:.3f}" for key in keys)] for row in figures["direct"]]
    keys = ("mean", "max", "max_fluorescent", "peercy_max")
    two = [[str(row["J"]), *(f"{row[key]:.3f}" for key in keys)] for row in figures["two_surfaces"]]
    return text_tables(
        [
            ("Direct light, ΔE94 from the full matrix", header, one),
            ("Two surfaces, ΔE94", ["J", "mean", "max", "max with fluorescence", "Peercy, max"], two),
        ]
    )


def main(arguments: list[str] | None = None) -> int:
    """Measure and print; 0."""
    parser = command(__doc__)
    parser.add_argument("file", nargs="?", type=Path)
    chosen = parser.parse_args(arguments)
    surfaces = surfaces_of(chosen.file) if chosen.file else made_up()
    figures = {"direct": direct(surfaces), "two_surfaces": two_surfaces(surfaces)}
    print(report(figures))
    write_json(chosen.json, figures)
    return 0


if __name__ == "__main__":
    sys.exit(main())
