"""State of the display that pictures are shown on: the file of it that lies beside its configuration."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

from ...calibration.display.record import read_record
from ...runtime.errors import InputError
from .transform import DisplayTransform

#: What `metamer display config` writes beside a configuration.
RECORD = "display.json"


def display_words(display: DisplayTransform, now: datetime | None = None) -> list[str]:
    """Name, model, last verification and its age, a sentence each; none for a display that is not characterised."""
    path = Path(display.config_name).parent / RECORD
    if display.config_name.startswith("ocio://") or not path.is_file():
        return []
    try:
        record = read_record(path)
    except InputError as reason:
        return [f"The file of the display cannot be used: {reason.file}: {reason.problem}."]
    words = [
        f"Display: {record.name}, characterised by {len(record.readings)} patches, model {record.model.name}, observer "
        f"{record.readings.observer}."
    ]
    if not record.verifications:
        return [*words, "It was never verified: `metamer display verify` says whether it still shows what it did."]
    last = record.verifications[-1]
    average = last.get("figures", {}).get("average")
    figure = "" if average is None else f", ΔE {average:.2f} on average"
    return [*words, f"Last verified {last.get('when', '')} ({_age(str(last.get('when', '')), now)}) by "
            f"{last.get('criteria', '')}: {last.get('verdict', '')}{figure}."]  # fmt: skip


def _age(when: str, now: datetime | None) -> str:
    try:
        then = datetime.fromisoformat(when)
    except ValueError:
        return "of unknown age"
    days = ((now or datetime.now(UTC)) - then).days
    return "today" if days < 1 else f"{days} day{'' if days == 1 else 's'} ago"
