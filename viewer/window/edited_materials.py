"""Materials with edited parameters, fitted in the background; until one is ready, the last one replaces it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from ...materials.catalogue.material import Material
from ...materials.search.edited_material import varied
from ...runtime.errors import InputError, MetamerError
from .background import Background

#: Values by slider name, sorted for use as a key.
Values = tuple[tuple[str, float], ...]
# Number of cached variants, each a fast form of some hundred kilobytes.
_KEPT = 32


class Fitting:
    """Background fitting, one variant at a time; of waiting ones only the newest of each material is done.

    waits : fit synchronously, for use without a window.
    """

    def __init__(self, load: Callable[[str], Material], waits: bool = False) -> None:
        self._load, self.waits = load, waits
        self._thread = Background()
        self._made: dict[tuple[str, Values], Material | MetamerError] = {}
        self._last: dict[str, Material] = {}

    @property
    def pending(self) -> bool:
        """True if a fit is running or waiting."""
        return self._thread.busy()

    def arrived(self) -> bool:
        """Return whether a fit has finished since the last call."""
        return bool(self._thread.poll())

    def close(self) -> None:
        """Stop fitting; a running fit ends by itself."""
        self._thread.close()

    def material(self, material_id: str, values: Values) -> Material | None:
        """Return the material with these values, or its replacement meanwhile; None for the material itself.

        Raises
        ------
        UnknownNameError, InputError : see `varied`, at each call.
        """
        key = material_id, values
        if self.waits:
            self._fit(key)
        found = self._made.get(key)
        if found is None:
            self._thread.ask(material_id, partial(self._fit, key))
            return self._last.get(material_id)
        self._thread.forget(material_id)
        if isinstance(found, MetamerError):
            raise found
        self._last[material_id] = found
        return found

    def _fit(self, key: tuple[str, Values]) -> None:
        """Fit a variant, unless it has been fitted since it was requested."""
        if key in self._made:
            return
        try:
            found = varied(self._load(key[0]), dict(key[1]))
        except MetamerError as reason:
            found = reason
        except (OSError, MemoryError) as reason:
            # Failures are cached too, to avoid retries.
            found = InputError(
                "could not be fitted",
                field=key[0],
                found=str(reason) or "not enough memory",
                hint="put the values back, or import the material again",
            )
        while len(self._made) >= _KEPT:
            self._made.pop(next(iter(self._made)))
        self._made[key] = found
