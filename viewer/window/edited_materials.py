"""Materials with other parameters, fitted beside the window: until one is ready, the last that was stands for it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from ...materials.catalogue.material import Material
from ...materials.search.edited_material import varied
from ...runtime.errors import InputError, MetamerError
from .background import Background

#: By name of a slider; sorted, so that it is a key.
Values = tuple[tuple[str, float], ...]
# Variants that are kept: each is a fast form, some hundred kilobytes.
_KEPT = 32


class Fitting:
    """Fits one variant at a time; of what waits only the newest of each material is done.

    waits : fit at once, and return when it is done: for who has no window to keep smooth.
    """

    def __init__(self, load: Callable[[str], Material], waits: bool = False) -> None:
        self._load, self.waits = load, waits
        self._thread = Background()
        self._made: dict[tuple[str, Values], Material | MetamerError] = {}
        self._last: dict[str, Material] = {}

    @property
    def pending(self) -> bool:
        """True if something is being fitted, or waits for it."""
        return self._thread.busy()

    def arrived(self) -> bool:
        """Return whether something has been fitted since this was last asked."""
        return bool(self._thread.poll())

    def close(self) -> None:
        """Fit nothing more; what is being fitted ends by itself."""
        self._thread.close()

    def material(self, material_id: str, values: Values) -> Material | None:
        """Return the material with these values, or what stands for it meanwhile; None where that is the material
        itself.

        Raises
        ------
        UnknownNameError, InputError : as of `varied`, each time that it is asked for.
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
        """Once: what is asked for again while it is being fitted is there when its turn comes."""
        if key in self._made:
            return
        try:
            found = varied(self._load(key[0]), dict(key[1]))
        except MetamerError as reason:
            found = reason
        except (OSError, MemoryError) as reason:
            # Kept as well: it would be tried again and again.
            found = InputError(
                "could not be fitted",
                field=key[0],
                found=str(reason) or "not enough memory",
                hint="put the values back, or import the material again",
            )
        while len(self._made) >= _KEPT:
            self._made.pop(next(iter(self._made)))
        self._made[key] = found
