"""Full-screen programs, and setting of uniforms and textures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from .programs import Key, Programs
from .resources import release_target

if TYPE_CHECKING:
    import moderngl


class FullScreen:
    """Program that runs a fragment shader at every pixel of a target.

    Raises
    ------
    ShaderError : the shader does not compile on this machine.
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
    """Set uniforms and bind textures; names that the compiler has optimised away are ignored."""
    # Testing whether a program has a name is linear in its names; looking it up is not.
    for unit, (name, texture) in enumerate((samplers or {}).items()):
        if made.get(name, None) is not None:
            texture.use(unit)
            made[name] = unit
    for name, value in values.items():
        if made.get(name, None) is not None:
            made[name] = value
