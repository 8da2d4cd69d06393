"""`metamer bench display`: simulated displays measured, modelled, driven through OpenColorIO, and looked at."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ...calibration.display.aim import Aim, aimed
from ...calibration.display.choice import ModelChoice, choose
from ...calibration.display.cube import Cube, make_cube
from ...calibration.display.drift import without_drift
from ...calibration.display.inverse import Inverse
from ...calibration.display.model_fit import MODELS, fit
from ...calibration.display.patches import patches
from ...runtime.errors import InputError
from ...spectral.difference import delta_e_xyz, lab_from_xyz
from ...viewer.display.config import write_config
from ...viewer.display.transform import DEFAULT_VIEW, DisplayTransform
from .simulated import SimulatedDisplay, displays

#: Patches, seeds of the instrument's noise, and bits that codes are sent in.
PATCHES, SEEDS, BITS = 125, 5, (8, 10)
# Held-out colours, greys of a row, and steps of the grey axis that must not go back.
_COLOURS, _GREYS, _STEPS = 1000, 33, 1025

#: Largest value allowed for each figure of `figures`.
BARS = {
    "chain mean": 0.30,
    "chain p95": 0.75,
    "chain max": 1.6,
    "LUT against the inverse, mean": 0.06,
    "LUT against the inverse, p95": 0.25,
    "LUT against the inverse, max": 1.0,
    "inverse: what is left of a colour that can be shown": 0.02,
    "file against memory": 1e-6,
    "white": 0.6,
    "grey ΔC mean": 0.25,
    "grey ΔC max": 0.6,
    "steps back on the grey axis, codes of 8 bits": 0.25,
    "regret of the choice": 0.1,
    "left of drift": 0.05,
    "seconds to build": 10.0,
}


@dataclass(frozen=True, eq=False)
class Driven:
    """One display, characterised from one set of noisy readings."""

    display: SimulatedDisplay
    seed: int
    choice: ModelChoice
    aim: Aim
    cube: Cube
    build_seconds: float

    @classmethod
    def of(cls, display: SimulatedDisplay, seed: int, folder: Path, count: int = PATCHES) -> Driven:
        """Measured, modelled and written to `folder`."""
        choice = choose(without_drift(display.measured(patches(count), seed)).readings)
        begun = time.process_time()
        aim = aimed(choice.model)
        cube = make_cube(choice.model)
        write_config(folder, _name(display), choice.model, cube, aim)
        return cls(display, seed, choice, aim, cube, time.process_time() - begun)


def _name(display: SimulatedDisplay) -> str:
    return f"{display.name} (simulated)"


def run(
    say: Callable[[str], None] = print, case: str | None = None, seeds: int = SEEDS, count: int = PATCHES
) -> dict[str, Any]:
    """Rows by display, seed and bits, and the worst of each figure that has a bar, with where it was."""
    rows: list[dict[str, Any]] = []
    worst: dict[str, tuple[float, str]] = {}

    def keep(figure: str, value: float, where: str) -> None:
        if figure not in worst or value > worst[figure][0]:
            worst[figure] = (float(value), where)

    there = displays()
    patterns = ("*",) if case is None else [one.strip() for one in case.split(",")]
    chosen = [display for display in there if any(fnmatchcase(display.name, one) for one in patterns)]
    if not chosen:
        names = ", ".join(display.name for display in there)
        raise InputError("no display is called so", field="--case", found=case, expected=names)
    for display in chosen:
        for seed in range(seeds):
            where = f"{display.name}, seed {seed}"
            with tempfile.TemporaryDirectory() as folder:
                driven = Driven.of(display, seed, Path(folder), count)
                transform = DisplayTransform(_name(display), DEFAULT_VIEW, str(Path(folder) / "config.ocio"))
                made = chain_rows(driven, transform)
                for figure, value in table_figures(driven, transform).items():
                    keep(figure, value, where)
            rows += made
            for row in made:
                found = row["delta_e94"]
                for key in ("mean", "p95", "max"):
                    keep(f"chain {key}", found[key], f"{where}, {row['bits']} bits")
                keep("white", row["white"], f"{where}, {row['bits']} bits")
                for key in ("mean", "max"):
                    keep(f"grey ΔC {key}", row["grey_delta_c"][key], f"{where}, {row['bits']} bits")
            keep("seconds to build", driven.build_seconds, where)
            at_8 = made[0]["delta_e94"]
            say(
                f"{where}: {driven.choice.model.name}, 8 bits ΔE94 {at_8['mean']:.2f} / {at_8['p95']:.2f} / "
                f"{at_8['max']:.2f}, built in {driven.build_seconds:.1f} s"
            )
    bars = [
        {"bar": figure, "at_most": BARS[figure], "measured": worst[figure][0], "worst": worst[figure][1]}
        for figure in BARS
        if figure in worst
    ]
    return {"rows": rows, "bars": bars}


def chain_rows(driven: Driven, transform: DisplayTransform) -> list[dict[str, Any]]:
    """Follow XYZ-D65 through OpenColorIO, rounded to bits, to what the true display shows: a row for each of `BITS`."""
    display, aim = driven.display, driven.aim
    held = np.random.default_rng(1000 + driven.seed).random((_COLOURS, 3))
    wanted = display.xyz(held)
    back = np.linalg.inv(aim.adapted)
    greys = np.linspace(0.0, 1.0, _GREYS)[1:, None] ** 3 * aim.white_xyz
    # Darker greys than the display's own black have no hue that could be asked for.
    greys = greys[greys[:, 1] > 2.0 * display.xyz(np.zeros((1, 3)))[0, 1]]
    rows = []
    for bits in BITS:
        shown, white, grey = (
            display.xyz(_sent(transform.apply(xyz @ back.T), bits)) for xyz in (wanted, aim.white_xyz[None], greys)
        )
        apart = delta_e_xyz(wanted, shown, aim.white_xyz)
        chroma = np.linalg.norm(
            lab_from_xyz(grey, aim.white_xyz)[:, 1:] - lab_from_xyz(greys, aim.white_xyz)[:, 1:], axis=1
        )
        rows.append(
            {
                "display": display.name,
                "seed": driven.seed,
                "model": driven.choice.model.name,
                "bits": bits,
                "delta_e94": _summary(apart),
                "white": float(delta_e_xyz(aim.white_xyz, white[0], aim.white_xyz)),
                "grey_delta_c": {"mean": float(chroma.mean()), "max": float(chroma.max())},
                "build_seconds": driven.build_seconds,
            }
        )
    return rows


def _summary(apart: Float[np.ndarray, " N"]) -> dict[str, float]:
    return {"mean": float(apart.mean()), "p95": float(np.percentile(apart, 95)), "max": float(apart.max())}


def _sent(codes: np.ndarray, bits: int) -> np.ndarray:
    steps = 2**bits - 1
    return np.round(np.clip(codes, 0.0, 1.0) * steps) / steps


def table_figures(driven: Driven, transform: DisplayTransform) -> dict[str, float]:
    """Measure what is not of the whole chain: tables beside the inverse, files beside memory, the choice, drift."""
    import PyOpenColorIO as ocio

    from ...viewer.display.config import display_transform

    model, display, aim = driven.choice.model, driven.display, driven.aim
    white = model.white_xyz
    held = np.random.default_rng(2000 + driven.seed).random((_COLOURS, 3))
    held[: _COLOURS // 5] **= 3.0
    wanted = model.xyz(held)
    codes, left = Inverse(model, white).codes(wanted)
    looked_up = np.clip(driven.cube.look_up(wanted), 0.0, 1.0)
    apart = delta_e_xyz(model.xyz(codes), model.xyz(looked_up), white)
    in_memory = ocio.Config.CreateRaw().getProcessor(display_transform(driven.cube, aim))
    depth = ocio.BIT_DEPTH_F32
    relative = (wanted @ np.linalg.inv(aim.adapted).T).astype(np.float32)
    memory = relative.copy()
    in_memory.getOptimizedCPUProcessor(depth, depth, ocio.OPTIMIZATION_LOSSLESS).applyRGB(memory)
    axis = transform.apply(np.linspace(0.0, 1.0, _STEPS)[:, None] ** 3 * aim.white_xyz @ np.linalg.inv(aim.adapted).T)
    back = np.maximum(np.maximum.accumulate(axis, axis=0) - axis, 0.0).max()
    summary = _summary(apart)
    return {
        "LUT against the inverse, mean": summary["mean"],
        "LUT against the inverse, p95": summary["p95"],
        "LUT against the inverse, max": summary["max"],
        "inverse: what is left of a colour that can be shown": float(left.max()),
        "file against memory": float(np.abs(memory - _direct(relative, transform, _name(display))).max()),
        "steps back on the grey axis, codes of 8 bits": float(back * 255.0),
        "regret of the choice": _regret(driven),
        "left of drift": _left_of_drift(display, driven.seed),
    }


def _direct(relative: np.ndarray, transform: DisplayTransform, name: str) -> np.ndarray:
    """Convert from the interchange space to the display's, as the file has it, without a view between."""
    import PyOpenColorIO as ocio

    depth = ocio.BIT_DEPTH_F32
    config = ocio.Config.CreateFromFile(transform.config_name)
    processor = config.getProcessor("cie_xyz_d65_interchange", name)
    values = relative.copy()
    processor.getOptimizedCPUProcessor(depth, depth, ocio.OPTIMIZATION_LOSSLESS).applyRGB(values)
    return values


def _true_error(display: SimulatedDisplay, model: Any) -> float:
    held = np.random.default_rng(7).random((_COLOURS, 3))
    white = display.xyz(np.ones((1, 3)))[0]
    return float(delta_e_xyz(display.xyz(held), model.xyz(held), white).mean())


def _regret(driven: Driven) -> float:
    """Mean ΔE94 of the model taken, less that of the best of all of them, on colours that none has seen."""
    readings = driven.display.measured(patches(PATCHES), driven.seed).averaged()
    errors = [_true_error(driven.display, fit(name, readings)) for name in MODELS]
    return _true_error(driven.display, driven.choice.model) - min(errors)


def _left_of_drift(display: SimulatedDisplay, seed: int) -> float:
    """Mean ΔE94 of readings that a warming-up by 3 % was taken out of, less that of readings without it."""
    codes = patches(PATCHES)

    def warming(place: np.ndarray) -> np.ndarray:
        return 1.0 - 0.03 * np.exp(-3.0 * place)[:, None] * np.array([1.0, 1.0, 1.2])

    end = warming(np.array([1.0]))
    truth = display.xyz(codes) * end
    steady = display.measured(codes, seed).xyz * end
    found = without_drift(display.measured(codes, seed, warming)).readings.xyz
    white = truth[0]
    return float(delta_e_xyz(truth, found, white).mean() - delta_e_xyz(truth, steady, white).mean())


def report(measured: dict[str, Any]) -> str:
    """Return the worst of each figure beside its bar."""
    from ...calibration.report.text_tables import columns

    rows = [[one["bar"], f"{one['at_most']:g}", f"{one['measured']:.3g}", one["worst"]] for one in measured["bars"]]
    return columns(["worst of all", "at most", "measured", "where"], rows, left=1)
