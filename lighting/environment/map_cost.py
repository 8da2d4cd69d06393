"""Cost of a map of light before it is read: memory and time by its texels and channels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ...runtime.memory import check_room, gigabytes

#: Bytes at the peak: of a stored sample while it is read, of a texel in each field of luminance, of a texel in what
#: directions are drawn by, and of the rows whose spectra are reduced at once. By a tenth to a half above what maps of
#: 2048 x 1024 and 4096 x 2048 took.
BYTES_A_SAMPLE, BYTES_A_FIELD, BYTES_A_TEXEL, BYTES_OF_ROWS = 8, 16, 32, 250_000_000
#: Seconds a stored sample, and a texel of a map whose spectra are reduced, on one core of a small machine.
SECONDS_A_SAMPLE, SECONDS_A_REDUCED_TEXEL = 1e-7, 6e-6
#: Maps that take less time than this are read without a word.
SAID_FROM_SECONDS = 2.0


@dataclass(frozen=True)
class MapCost:
    """Cost of a map by its texels and channels; `fields` of luminance are made of them."""

    texels: int
    channels: int
    fields: int = 1

    @property
    def memory_bytes(self) -> int:
        """At the peak."""
        texel = BYTES_A_SAMPLE * self.channels + BYTES_A_FIELD * self.fields + BYTES_A_TEXEL
        return self.texels * texel + BYTES_OF_ROWS * (self.fields > 1)

    @property
    def seconds(self) -> float:
        """Seconds on one core of a small machine."""
        return self.texels * (SECONDS_A_SAMPLE * self.channels + SECONDS_A_REDUCED_TEXEL * (self.fields > 1))

    @property
    def words(self) -> str:
        """Cost in words."""
        return (
            f"{self.texels:,} texels of {self.channels} channels, up to {gigabytes(self.memory_bytes)} of memory and "
            f"{max(1.0, self.seconds):.0f} s"
        )

    def check_room(self, path: Path, say: Callable[[str], None] | None = None) -> None:
        """Raise `InputError` where this does not fit into the memory that there is; `say` what takes long."""
        check_room(
            self.memory_bytes,
            "the map does not fit into memory",
            self.words,
            "save it smaller: half the width takes a quarter; nothing is made smaller unasked",
            file=path,
        )
        if say is not None and self.seconds >= SAID_FROM_SECONDS:
            say(f"reading {path.name}: {self.words}")
