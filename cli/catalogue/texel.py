"""`metamer catalogue show --texel`: the apparent BRDF of one texel of a BTF, as charts or for a program."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...calibration.report.text_tables import columns
from ..output import on_standard_output, write_json
from .text_chart import text_chart

if TYPE_CHECKING:
    from ...materials.btf.apparent_brdf import ApparentBrdf
    from ...materials.records.material import MaterialRecord

# Views that are charted: the measured ones nearest to these, along u.
_SEEN_DEG = (0.0, 30.0, 60.0)
_QUANTITY = "pi f_r cos(theta_i), XYZ; the perfect diffuser, lit along its normal, has Y = 1"


def texel(text: str) -> tuple[int, int]:
    """Parse X,Y of an option."""
    parts = text.split(",")
    try:
        x, y = (int(part) for part in parts)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected column and row, as 12,40") from None
    return x, y


def print_texel(record: MaterialRecord, at: tuple[int, int], json: Path | None) -> None:
    """Print the apparent BRDF of one texel of a BTF, and the error of its fast form against its images.

    Raises
    ------
    InputError : a material that is no BTF, or has no fast form of one; a texel outside the BTF.
    """
    from ...materials.btf.apparent_brdf import apparent_brdf
    from ...materials.btf.form import BtfForm, FieldForm
    from ...materials.btf.metric import LIGHTS
    from ...materials.btf.surface import MeasuredBtf
    from ...materials.records.record import stored_arrays
    from ...runtime.errors import InputError
    from ...spectral.folding import Folding
    from ...spectral.illuminants import illuminant
    from ...spectral.observers import observer

    fast = record.fast
    if not isinstance(fast, BtfForm | FieldForm):
        raise InputError(
            "--texel is for BTFs",
            field=record.id,
            found=f"model {record.model}",
            expected="model btf, with a fast form of one",
        )
    gone = sorted({str(array.file) for array in stored_arrays(record) if not array.is_there})
    surface = None if gone else record.surface()
    images = surface.images if isinstance(surface, MeasuredBtf) else None
    folding = Folding(observer("1931_2"), [illuminant(name) for name in LIGHTS], np.pi)
    found = apparent_brdf(fast, images, *at, folding)
    if json is not None:
        write_json(json, _document(record, found, LIGHTS, fast.WORDS, gone))
    if not on_standard_output(json):
        _print(record, found, LIGHTS, fast.WORDS, gone)


def _print(record: MaterialRecord, found: ApparentBrdf, lights: tuple[str, ...], words: str, gone: list[str]) -> None:
    from ...materials.btf.apparent_brdf import in_plane

    print(f"{record.id}, texel in column {found.x}, row {found.y} (0 on top)")
    rows = _figures(found, lights)
    if rows:
        print(f"ΔE94 of {words} against the images, over {len(found.views)} views x {len(found.lights)} lights")
        print(columns(("light", *rows[0][1]), [[name, *_shown(row)] for name, row in rows], left=1))
    else:
        print(f"shown is the fast form alone, {words}; images are gone: {', '.join(gone)}")
    print(
        f"\nY under {lights[0]} of {_QUANTITY}\nagainst theta_i in the plane of incidence, negative beside the viewer"
    )
    lowest = np.degrees(np.arccos(found.lights.lowest))
    angles = np.linspace(-lowest, lowest, 65)
    views = found.views.directions
    wanted = np.radians(_SEEN_DEG)
    nearest = [int(np.argmax(views @ (np.sin(angle), 0.0, np.cos(angle)))) for angle in wanted]
    for view in dict.fromkeys(nearest):
        theta, phi = _degrees(views[view : view + 1])[0]
        for name, values in ((words, found.fast), ("images", found.original)):
            if values is not None:
                shown = in_plane(values[view, :, 1], found.lights, views[view], np.radians(angles))
                print(f"\nSeen from theta {theta:g}, phi {phi:g}: {name}")
                print(text_chart(angles, shown, height=5, unit="deg"))


def _figures(found: ApparentBrdf, lights: tuple[str, ...]) -> list[tuple[str, dict[str, float]]]:
    off = found.differences()
    if off is None:
        return []
    named = {"mean": np.mean, "p95": lambda one: np.percentile(one, 95), "p99": lambda one: np.percentile(one, 99)}
    named |= {"maximum": np.max}
    return [(name, {word: float(of(one)) for word, of in named.items()}) for name, one in zip(lights, off, strict=True)]


def _shown(row: dict[str, float]) -> list[str]:
    return [f"{value:.3f}" for value in row.values()]


def _document(
    record: MaterialRecord, found: ApparentBrdf, lights: tuple[str, ...], words: str, gone: list[str]
) -> dict[str, Any]:
    def listed(values: np.ndarray | None) -> Any:
        return None if values is None else values.reshape(*values.shape[:2], len(lights), 3).tolist()

    off = found.differences()
    return {
        "id": record.id,
        "texel": [found.x, found.y],
        "form": words,
        "quantity": _QUANTITY,
        "illuminants": list(lights),
        "observer": "1931_2",
        "views_deg": _degrees(found.views.directions).tolist(),
        "lights_deg": _degrees(found.lights.directions).tolist(),
        "axes": "view, light, illuminant, XYZ",
        "fast": listed(found.fast),
        "original": listed(found.original),
        "gone": gone,
        "delta_e94": dict(_figures(found, lights)),
        "delta_e94_each": None if off is None else off.transpose(1, 2, 0).tolist(),
    }


def _degrees(directions: np.ndarray) -> np.ndarray:
    """Convert directions to theta and phi (n,2)."""
    theta = np.degrees(np.arctan2(np.hypot(directions[:, 0], directions[:, 1]), directions[:, 2]))
    phi = np.degrees(np.arctan2(directions[:, 1], directions[:, 0])) % 360.0
    return np.round(np.stack([theta, np.where(theta > 1e-6, phi, 0.0)], axis=-1), 4) % 360.0
