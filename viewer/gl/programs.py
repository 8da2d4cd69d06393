"""Cache of compiled programs by their sources; reloaded from files all together, or not at all."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from .shaders import program

if TYPE_CHECKING:
    import moderngl

#: Vertex and fragment file, `#define`d sizes, and the file of a form's terms.
Key = tuple[str, str, tuple[tuple[str, int | float], ...], Path | None]


class CachedProgram(NamedTuple):
    """Program with its vertex array without buffers."""

    program: moderngl.Program
    everywhere: moderngl.VertexArray

    def release(self) -> None:
        """Free program and vertex array."""
        self.everywhere.release()
        self.program.release()


class Programs:
    """Programs of one context, compiled on first use."""

    def __init__(self, context: moderngl.Context) -> None:
        self.context = context
        self._made: dict[Key, CachedProgram] = {}

    def of(self, key: Key) -> CachedProgram:
        """Return a program; raises `ShaderError` if it does not compile on this machine."""
        if key not in self._made:
            self._made[key] = self._compiled(key)
        return self._made[key]

    def release(self) -> None:
        """Free all programs."""
        while self._made:
            self._made.popitem()[1].release()

    def compiled_again(self) -> Callable[[], None]:
        """Recompile all programs from their current files; calling the result installs them.

        Raises
        ------
        ShaderError : one does not compile; the existing ones stay.
        """
        fresh: dict[Key, CachedProgram] = {}
        try:
            for key in self._made:
                fresh[key] = self._compiled(key)
        except BaseException:
            for one in fresh.values():
                one.release()
            raise

        def put() -> None:
            self.release()
            self._made.update(fresh)

        return put

    def _compiled(self, key: Key) -> CachedProgram:
        vertex, fragment, sizes, terms = key
        made = program(self.context, vertex, fragment, dict(sizes), terms)
        return CachedProgram(made, self.context.vertex_array(made, []))


def read_again(all_of_them: Iterable[Programs]) -> None:
    """Recompile several sets of programs from their files; either all are installed, or none.

    Raises
    ------
    ShaderError : see `Programs.compiled_again`.
    """
    ready = [one.compiled_again() for one in dict.fromkeys(all_of_them)]
    for put in ready:
        put()
