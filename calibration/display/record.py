"""Record of a characterised display: one JSON file, with the readings of the model."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...runtime.files import existing_file, written_whole
from .additivity import Additivity
from .aim import Aim, AimSettings, Black, aimed
from .choice import ModelChoice
from .model import DisplayModel
from .readings import Readings, ReadingSpectra

_MARK, _VERSION = "metamer_display", 1


@dataclass(frozen=True, eq=False)
class DisplayRecord:
    """Characterised display.

    Parameters
    ----------
    name : of the display. model : from codes to XYZ. readings : one a patch, without drift.
    digest : SHA-256 of the raw readings, which identifies their file. read : (n,6) codes and XYZ of each, which
        identify parts of it; missing in older files.
    reason : of the choice of the model. held_back : mean ΔE94 of held-out patches, by model.
    additivity : of the channels. repeatability : relative standard deviation of X, Y, Z, or None.
    notes : remarks, a sentence each. verifications : earlier ones, as of `verification.kept`.
    settings : aim of the configuration written with this; D65 without one.
    """

    name: str
    model: DisplayModel
    readings: Readings
    digest: str
    reason: str
    held_back: Mapping[str, float]
    additivity: Additivity
    repeatability: Float[np.ndarray, "3"] | None
    notes: tuple[str, ...] = ()
    verifications: tuple[Mapping[str, Any], ...] = field(default_factory=tuple)
    read: Float[np.ndarray, "n 6"] = field(default_factory=lambda: np.zeros((0, 6)))
    settings: AimSettings = field(default_factory=AimSettings)

    @property
    def aim(self) -> Aim:
        """Aim by its settings; errors as of `aimed`."""
        readings, asked = self.readings, self.settings
        return aimed(self.model, asked.white, asked.luminance, readings.absolute, readings.observer)

    @classmethod
    def of(cls, name: str, raw: Readings, used: Readings, choice: ModelChoice, notes: tuple[str, ...]) -> DisplayRecord:
        """Make the record from raw readings, the same without drift, and the choice based on them."""
        return cls(
            name,
            choice.model,
            used.averaged(),
            digest(raw),
            choice.reason,
            choice.held_back,
            choice.additivity,
            used.repeatability,
            notes,
            read=np.concatenate([raw.codes, raw.xyz], axis=1),
        )

    def write(self, path: str | Path) -> None:
        """Write the file, whole or not at all.

        Raises
        ------
        InputError, NoRoomError : the folder is missing or cannot be written to; its disk is full.
        """
        readings = self.readings
        kept: dict[str, Any] = {
            _MARK: _VERSION,
            "name": self.name,
            "instrument": readings.instrument,
            "observer": readings.observer,
            "absolute": readings.absolute,
            "measured": readings.measured,
            "source": readings.source,
            "digest": self.digest,
            "reason": self.reason,
            "held_back": dict(self.held_back),
            "additivity": vars(self.additivity),
            "repeatability": None if self.repeatability is None else self.repeatability.tolist(),
            "notes": list(self.notes),
            "model": self.model.document,
            "readings": {
                "codes": readings.codes.tolist(),
                "xyz": readings.xyz.tolist(),
                "repeats": np.broadcast_to(readings.repeats, len(readings)).tolist(),
            },
            "verifications": [dict(one) for one in self.verifications],
            "read": self.read.tolist(),
            "aim": vars(self.settings),
        }
        for key in ("spectra", "primaries"):
            spectra = getattr(readings, key)
            if spectra is not None:
                kept[key] = {name: values.tolist() for name, values in vars(spectra).items()}
        with written_whole(path) as beside:
            beside.write_text(json.dumps(kept, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def read_record(path: str | Path) -> DisplayRecord:
    """Read the file of `DisplayRecord.write`.

    Raises
    ------
    InputError : a missing file, another kind of file, or a later version.
    """
    path = existing_file(path)
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))
        version = kept[_MARK]
    except (UnicodeDecodeError, json.JSONDecodeError, KeyError, TypeError) as reason:
        raise _unusable(path, "not a characterised display", str(reason)[:120]) from None
    if version != _VERSION:
        raise _unusable(path, "a characterised display of another version", f"version {version}")
    try:
        array = {key: np.array(kept["readings"][key], dtype=np.float64).reshape(-1, 3) for key in ("codes", "xyz")}
        spectra, primaries = (
            ReadingSpectra(*(np.array(held[name], dtype=np.float64) for name in ("wavelengths_nm", "radiance")))
            if (held := kept.get(key)) is not None
            else None
            for key in ("spectra", "primaries")
        )
        repeatability = kept["repeatability"]
        readings = Readings(
            array["codes"],
            array["xyz"],
            kept["source"],
            kept["name"],
            kept["instrument"],
            kept["observer"],
            bool(kept["absolute"]),
            spectra,
            kept["measured"],
            # Files of before it was kept have none.
            repeats=np.array(kept["readings"].get("repeats", np.ones(len(array["codes"]))), dtype=np.int64),
            primaries=primaries,
        )
        return DisplayRecord(
            kept["name"],
            DisplayModel.of_document(kept["model"]),
            readings,
            kept["digest"],
            kept["reason"],
            kept["held_back"],
            Additivity(**kept["additivity"]),
            None if repeatability is None else np.array(repeatability, dtype=np.float64),
            tuple(kept["notes"]),
            tuple(kept["verifications"]),
            np.array(kept.get("read", []), dtype=np.float64).reshape(-1, 6),
            _settings(kept.get("aim", {})),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as reason:
        raise _unusable(path, "a damaged file of a display", f"{type(reason).__name__}: {reason}"[:120]) from None


def _settings(kept: Mapping[str, Any]) -> AimSettings:
    """Return the aim stored in a file; ValueError for an invalid one."""
    white, luminance, black = (kept.get(key, getattr(AimSettings, key)) for key in ("white", "luminance", "black"))
    white = white if white in ("d65", "native") else tuple(float(one) for one in white)
    luminance = None if luminance is None else float(luminance)
    if (len(white) != 2 and not isinstance(white, str)) or black not in get_args(Black):
        raise ValueError(f"no aim of a display: {dict(kept)}")
    return AimSettings(white, luminance, black)


def _unusable(path: Path, problem: str, found: str) -> InputError:
    return InputError(
        problem,
        file=path,
        found=found,
        expected=f"a file that `metamer display characterise` wrote, version {_VERSION}",
        hint="characterise the display again from its readings",
    )


def digest(readings: Readings) -> str:
    """Compute the SHA-256 of codes and XYZ, independent of their order."""
    rows = np.round(np.concatenate([readings.codes, readings.xyz], axis=1), 9) + 0.0
    return hashlib.sha256(np.ascontiguousarray(rows[np.lexsort(rows.T)]).tobytes()).hexdigest()
