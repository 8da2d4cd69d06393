"""Compiled programs, kept by what they were made of; read again from their files all together, or not at all."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from .shaders import program

if TYPE_CHECKING:
    import moderngl

#: Vertex and fragment file, sizes written into them, and the file of a form's terms.
Key = tuple[str, str, tuple[tuple[str, int | float], ...], Path | None]


class CachedProgram(NamedTuple):
    """A program, and its vertex array without buffers."""

    program: moderngl.Program
    everywhere: moderngl.VertexArray

    def release(self) -> None:
        """Free both."""
        self.everywhere.release()
        self.program.release()


class Programs:
    """Programs of one context, compiled when first asked for."""

    def __init__(self, context: moderngl.Context) -> None:
        self.context = context
        self._made: dict[Key, CachedProgram] = {}

    def of(self, key: Key) -> CachedProgram:
        """Raises `ShaderError` where this machine's compiler refuses it."""
        if key not in self._made:
            self._made[key] = self._compiled(key)
        return self._made[key]

    def release(self) -> None:
        """Free them all."""
        while self._made:
            self._made.popitem()[1].release()

    def compiled_again(self) -> Callable[[], None]:
        """Return all of them from their files as those are now; to call what comes back puts them in place.

        Raises
        ------
        ShaderError : one does not compile; those that are there stay.
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
    """Compile several sets of programs from their files; either all are put in place, or none is.

    Raises
    ------
    ShaderError : as of `Programs.compiled_again`.
    """
    ready = [one.compiled_again() for one in dict.fromkeys(all_of_them)]
    for put in ready:
        put()
