"""Errors of colours when spectra are thinned or written in a few numbers.

Every figure is the largest ΔE94 over ColorChecker 24 (BabelColor averages) under the CIE 1931 2 degree observer, in
CIELAB relative to each light's own white, with the slower and finer computation as the reference.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..calibration.report.text_tables import TextTable, text_tables
from ..spectral.axis_letters import Wavelengths
from ..spectral.basis import SpectralBasis
from ..spectral.colour_library import colour_science
from ..spectral.difference import delta_e_xyz
from ..spectral.illuminants import illuminant, illuminant_names
from ..spectral.minimax_basis import minimax_basis
from ..spectral.observers import Observer, observer
from ..spectral.spectrum import Spectrum
from ..spectral.upsampling import xyz_from_rgb
from ..spectral.wavelengths import WORKING_WAVELENGTHS_NM, interpolation_matrix
from .timing import timed

#: The lights that a basis is made for.
LIGHTS = ("D65", "A", *(f"FL{number}" for number in range(1, 13)))
SAMPLING_LIGHTS = ("D65", "A", "FL2", "FL11", "FL12", "HP1")
SIZES = (3, 4, 5, 6, 7, 8, 9, 10, 12, 16)
#: Grids on which light, observer and reflectance are all point-sampled: label -> first, last, step in nm.
GRIDS = {
    "380-780 / 5 nm": (380, 780, 5),
    "380-780 / 10 nm": (380, 780, 10),
    "400-700 / 5 nm": (400, 700, 5),
    "400-700 / 10 nm": (400, 700, 10),
}
FOLDED = "380-780 / 5 nm, lights folded first"
# In linear sRGB, in which most tools multiply a light with a surface.
RGB = "RGB multiply"
_PEERCY_SCALES = (0.01, 0.1, 1.0, 10.0)


@dataclass(frozen=True, eq=False)
class Stage:
    """Test data of a basis.

    Parameters
    ----------
    reflectances : (n,L) on the working wavelengths.
    weights : light name -> (3,L) with XYZ = weights @ r, white Y = 1.
    """

    reflectances: Float[np.ndarray, "n L"]
    weights: dict[str, np.ndarray]

    @property
    def columns(self) -> Float[np.ndarray, "L m"]:
        """Light x CMF of every light side by side, as the constructors of `SpectralBasis` take them."""
        return np.concatenate([weights.T for weights in self.weights.values()], axis=1)

    def under(self, lights: Sequence[str]) -> Stage:
        """Return the same surfaces under other lights."""
        return stage(lights, self.reflectances)


def colour_checker() -> Spectrum:
    """Return the 24 reflectances as colour-science tabulates them, 380-730 nm by 10 nm."""
    patches = colour_science().SDS_COLOURCHECKERS["BabelColor Average"].values()
    first = next(iter(patches))
    return Spectrum.sampled(first.wavelengths, np.array([patch.values for patch in patches]), "reflectance")


def stage(lights: Sequence[str] = LIGHTS, reflectances: np.ndarray | None = None) -> Stage:
    """ColorChecker, or other `reflectances` (n,L), under `lights` on the working wavelengths."""
    grid, eye = WORKING_WAVELENGTHS_NM, observer("1931_2")
    if reflectances is None:
        reflectances = colour_checker().resampled(grid).samples
    return Stage(reflectances, {name: eye.weights(illuminant(name), grid) for name in lights})


def worst(reference_xyz: np.ndarray, sample_xyz: np.ndarray, white_xyz: np.ndarray) -> float:
    """Largest ΔE94 of two tables of XYZ."""
    return float(delta_e_xyz(reference_xyz, sample_xyz, white_xyz, "CIE 1994").max())


def sampling_errors(lights: Sequence[str] = SAMPLING_LIGHTS) -> dict[str, dict[str, float]]:
    """Error of each grid against 360-830 nm at 1 nm, by grid and light; and of multiplying in RGB."""
    eye = observer("1931_2")
    fine = np.arange(360.0, 831.0)
    chart = colour_checker().resampled(fine).samples
    table: dict[str, dict[str, float]] = {label: {} for label in (FOLDED, *GRIDS, RGB)}
    d65 = chart @ point_sampled(eye, "D65", fine).T
    for name in lights:
        weights = point_sampled(eye, name, fine)
        truth, white = chart @ weights.T, weights.sum(axis=1)
        for label, (first, last, step) in GRIDS.items():
            grid = np.arange(float(first), last + 1.0, step)
            thinned = chart[:, np.searchsorted(fine, grid)] @ point_sampled(eye, name, grid).T
            table[label][name] = worst(truth, thinned, white)
        grid = WORKING_WAVELENGTHS_NM
        folded = chart[:, np.searchsorted(fine, grid)] @ eye.weights(illuminant(name), grid).T
        table[FOLDED][name] = worst(truth, folded, white)
        rgb = np.linalg.solve(xyz_from_rgb(), d65.T) * np.linalg.solve(xyz_from_rgb(), white)[:, None]
        table[RGB][name] = worst(truth, (xyz_from_rgb() @ rgb).T, white)
    return table


def point_sampled(eye: Observer, light: str, grid: Wavelengths) -> Float[np.ndarray, "3 L"]:
    """Weights (3,L) as the plain sum over one grid has them: light and observer read off at its wavelengths only."""
    spectrum = illuminant(light)
    power = interpolation_matrix(spectrum.wavelengths_nm, grid, "hold", "linear") @ spectrum.samples
    functions = interpolation_matrix(eye.wavelengths_nm, grid, "zero", "linear") @ eye.cmfs
    products = power[:, None] * functions
    return (products / products[:, 1].sum()).T


def basis_error(basis: SpectralBasis, on: Stage) -> float:
    """Largest error over the surfaces and lights of `on`, against every sample."""
    return spread_of_errors(basis, on)[1]


def unseen() -> Stage:
    """Return the 99 colour evaluation samples (CIE 224:2017) under every CIE and ISO light that no basis here is made
    for.
    """
    from colour.quality.cfi2017 import load_TCS_CIE2017

    grid = WORKING_WAVELENGTHS_NM
    samples = load_TCS_CIE2017(colour_science().SpectralShape(grid[0], grid[-1], float(grid[1] - grid[0])))
    return stage([name for name in illuminant_names() if name not in LIGHTS], np.asarray(samples.values).T)


def spread_of_errors(basis: SpectralBasis, on: Stage) -> tuple[float, float]:
    """95th percentile and largest ΔE94 over all surfaces and lights of `on`."""
    coefficients = basis.project(on.reflectances)
    found = [
        delta_e_xyz(on.reflectances @ w.T, coefficients @ (w @ basis.synthesis).T, w.sum(axis=1))
        for w in on.weights.values()
    ]
    return float(np.percentile(found, 95)), float(np.max(found))


def two_bounce_error(basis: SpectralBasis, on: Stage) -> float:
    """Largest error over all ordered pairs of surfaces, the second bounce as `operator`."""
    surfaces = on.reflectances
    products = surfaces[:, None] * surfaces
    coefficients = np.einsum("ajk,bk->abj", basis.operator(surfaces), basis.project(surfaces))
    return max(
        worst(products @ w.T, coefficients @ (w @ basis.synthesis).T, w.sum(axis=1)) for w in on.weights.values()
    )


def with_products(reflectances: Float[np.ndarray, "n L"]) -> Float[np.ndarray, "m L"]:
    """Reflectances and every product of two of them: what a scene shows where light bounces."""
    pairs = reflectances[:, None] * reflectances
    return np.concatenate([reflectances, pairs[np.triu_indices(len(reflectances))]])


def basis_errors(sizes: Sequence[int] = SIZES) -> dict[str, dict[str, dict[int, float]]]:
    """Largest ΔE94 by question, basis and size.

    Questions: "one_bounce" under the lights of the basis, "two_bounces" with products in the set, "lights_outside"
    under every other CIE and ISO light, "unseen" other surfaces there too (and "unseen, p95"). Peercy's rows depend on
    how long lights are beside reflectances; they give the default scale, and for "one_bounce" also the best and worst
    of four decades.
    """
    on = stage()
    strange = unseen()
    outside = on.under(list(strange.weights))
    products = with_products(on.reflectances)
    made: dict[str, Callable[..., SpectralBasis]] = {
        "minimax": minimax_basis,
        "balanced": SpectralBasis.balanced,
        "peercy": SpectralBasis.peercy,
    }
    questions = ("one_bounce", "two_bounces", "lights_outside", "unseen", "unseen, p95")
    table: dict[str, dict[str, dict[int, float]]] = {question: {} for question in questions}
    for name, make in made.items():
        bases = {size: make(on.reflectances, on.columns, size) for size in sizes}
        table["one_bounce"][name] = {size: basis_error(basis, on) for size, basis in bases.items()}
        table["lights_outside"][name] = {size: basis_error(basis, outside) for size, basis in bases.items()}
        spread = {size: spread_of_errors(basis, strange) for size, basis in bases.items()}
        table["unseen"][name] = {size: largest for size, (_, largest) in spread.items()}
        table["unseen, p95"][name] = {size: p95 for size, (p95, _) in spread.items()}
        table["two_bounces"][name] = {size: two_bounce_error(make(products, on.columns, size), on) for size in sizes}
    scaled = {
        size: [
            basis_error(SpectralBasis.peercy(on.reflectances, on.columns, size, light_scale=scale), on)
            for scale in _PEERCY_SCALES
        ]
        for size in sizes
    }
    table["one_bounce"]["peercy, best scale"] = {size: min(errors) for size, errors in scaled.items()}
    table["one_bounce"]["peercy, worst scale"] = {size: max(errors) for size, errors in scaled.items()}
    return table


def basis_seconds(size: int = 8, spectra: int = 100_000, repeats: int = 15) -> dict[str, float]:
    """Seconds of making a basis, projecting, folding, and colouring `spectra` surfaces; the best of `repeats`.

    Colouring from samples and from coefficients are timed in the same run: their ratio is what means something.
    """
    on, eye = stage(), observer("1931_2")
    basis = SpectralBasis.balanced(on.reflectances, on.columns, size)
    rng = np.random.default_rng(0)
    samples = rng.uniform(0, 1, (spectra, WORKING_WAVELENGTHS_NM.size))
    coefficients = basis.project(samples)
    weights = on.weights["D65"]
    folded = weights @ basis.synthesis
    jobs: dict[str, Callable[[], object]] = {
        "make": lambda: SpectralBasis.balanced(on.reflectances, on.columns, size),
        "project": lambda: basis.project(samples),
        "fold": lambda: basis.fold(illuminant("FL11"), eye),
        "colour_from_samples": lambda: samples @ weights.T,
        "colour_from_coefficients": lambda: coefficients @ folded.T,
    }
    # In turns, so that a busy moment of the machine is nobody's alone.
    taken = [{name: timed(job)[1] for name, job in jobs.items()} for _ in range(repeats)]
    return {name: min(turn[name] for turn in taken) for name in jobs}


def run(sizes: Sequence[int] = SIZES, spectra: int = 100_000) -> dict:
    """Everything above as one JSON-ready dictionary."""
    return {
        "chart": "ColorChecker 24, BabelColor Average",
        "observer": "CIE 1931 2 Degree Standard Observer",
        "lights": list(LIGHTS),
        "statistic": "max delta E 94",
        "sampling": sampling_errors(),
        **basis_errors(sizes),
        "spectra": spectra,
        "seconds": basis_seconds(spectra=spectra),
    }


def tables(measured: dict) -> list[TextTable]:
    """Return the result of `run` as tables of text: title, header, rows."""
    lights = list(next(iter(measured["sampling"].values())))
    found = [
        (
            "Sampling, against 360-830 nm at 1 nm",
            ["grid", *lights],
            [[label, *(f"{row[name]:.2f}" for name in lights)] for label, row in measured["sampling"].items()],
        )
    ]
    titles = {
        "one_bounce": f"Basis of J coefficients, {len(measured['lights'])} lights",
        "two_bounces": "Two bounces, every pair, products in the set",
        "lights_outside": "Lights that the basis was not made for",
        "unseen": "Colour evaluation samples under those lights: neither was seen",
        "unseen, p95": "The same, 95th percentile",
    }
    for key, title in titles.items():
        bases = measured[key]
        rows = [[str(size), *(f"{row[size]:.2f}" for row in bases.values())] for size in next(iter(bases.values()))]
        found.append((title, ["J", *bases], rows))
    seconds = measured["seconds"]
    ratio = seconds["colour_from_coefficients"] / seconds["colour_from_samples"]
    rows = [[name, f"{1e3 * value:.3f}"] for name, value in seconds.items()]
    rows.append(["coefficients : samples", f"{ratio:.2f}"])
    found.append((f"Milliseconds, {measured['spectra']} spectra, one run", ["step", "ms"], rows))
    return found


def report(measured: dict) -> str:
    """Return the result of `run` as plain text, columns under each other."""
    heading = "Largest ΔE94 over ColorChecker 24, CIE 1931 2 degree observer, each light's own white"
    return f"{heading}\n\n{text_tables(tables(measured))}"
