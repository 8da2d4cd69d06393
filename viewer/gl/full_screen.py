"""Programs that run at every pixel of a target; and how any program is given its values and textures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from .programs import Key, Programs
from .resources import release_target

if TYPE_CHECKING:
    import moderngl


class FullScreen:
    """A fragment shader at every pixel of what it is drawn onto.

    Raises
    ------
    ShaderError : this machine's compiler refuses it.
    """

    def __init__(
        self, context: moderngl.Context, fragment: str, defines: Mapping[str, int | float] | None = None
    ) -> None:
        self.context = context
        self.programs = Programs(context)
        self._key: Key = ("fullscreen.vert", fragment, tuple((defines or {}).items()), None)
        self.programs.of(self._key)

    def draw(
        self,
        onto: moderngl.Texture,
        samplers: Mapping[str, moderngl.Texture],
        values: Mapping[str, object] | None = None,
        box: tuple[int, int, int, int] | None = None,
    ) -> None:
        """Write every pixel of a texture, or of a box (x, y, width, height) of it."""
        target = self.context.framebuffer([onto])
        try:
            target.use()
            target.viewport = target.scissor = (0, 0, *onto.size) if box is None else box
            self.context.enable_only(self.context.NOTHING)
            made, everywhere = self.programs.of(self._key)
            set_values(made, values or {}, samplers)
            everywhere.render(self.context.TRIANGLES, vertices=3)
        finally:
            release_target(target)

    def release(self) -> None:
        """Free the program."""
        self.programs.release()


def set_values(
    made: moderngl.Program, values: Mapping[str, object], samplers: Mapping[str, moderngl.Texture] | None = None
) -> None:
    """Set uniforms and bind textures; a compiler may have dropped what it found unused."""
    # To ask whether a program has a name goes through all of its names; to ask for it does not.
    for unit, (name, texture) in enumerate((samplers or {}).items()):
        if made.get(name, None) is not None:
            texture.use(unit)
            made[name] = unit
    for name, value in values.items():
        if made.get(name, None) is not None:
            made[name] = value
