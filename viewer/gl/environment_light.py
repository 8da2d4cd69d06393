"""Area, environment and indirect light on the GPU: cached tables, and the draw calls that gather light."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from ...lighting.environment.panel import GatheredPanel
from ...lighting.transfer.indirect import IndirectLight
from ..render.layers import SpreadLayer
from .light_textures import (
    LightTables,
    bright_tables,
    hidden_tables,
    indirect_tables,
    light_tables,
    panel_tables,
    visibility_tables,
)
from .passes import MOST_FOLDED, MOST_QUADS, Passes
from .resources import Owner

if TYPE_CHECKING:
    import moderngl

#: Samplers of a tile's frames, in the order of its textures.
FRAMES = ("tangent", "bitangent", "normal", "position", "standing", "faces")


# Number of cached tables on the GPU, some 20 MB each.
_MOST_TABLES = 12


class Draw(NamedTuple):
    """Draw call: its target, the shader's sizes for its output, and the first of its rows of four terms.

    Rows are counted within a field; a call writes the same ones of every field.
    """

    target: moderngl.Framebuffer
    scissor: tuple[int, int, int, int] | None
    written: Mapping[str, int]
    first_row: int


class GLGathering:
    """Gathering of light for environment forms, with cached tables of the last few lights."""

    def __init__(self, context: moderngl.Context, passes: Passes) -> None:
        self.context, self.passes = context, passes
        self._tables: dict[tuple, tuple[object, LightTables]] = {}

    def release(self) -> None:
        """Free the tables."""
        for _, tables in self._tables.values():
            tables.owner.release()
        self._tables.clear()

    def terms(
        self,
        quads: Sequence[moderngl.Texture],
        layer: SpreadLayer,
        filtered: bool,
        samplers: Mapping[str, moderngl.Texture],
        values: Mapping[str, object],
    ) -> None:
        """Write a layer's terms, four per texture. samplers, values : a tile's inputs of `gather.frag`."""
        owner, draws = Owner(self.context), []
        try:
            for some in _shared(layer, MOST_QUADS):
                chosen = [quads[field * _rows(layer) + row] for field in range(_fields(layer)) for row in some]
                target = owner.keep(self.context.framebuffer(chosen))
                target.clear()
                draws.append(Draw(target, None, {"ROWS_A_CALL": len(some)}, some.start))
            self._gather(draws, layer, filtered, samplers, values)
        finally:
            owner.release()

    def pictures(
        self,
        target: moderngl.Framebuffer,
        box: tuple[int, int, int, int],
        layer: SpreadLayer,
        filtered: bool,
        samplers: Mapping[str, moderngl.Texture],
        values: Mapping[str, object],
    ) -> None:
        """Add a folded layer to an image of each spectrum. samplers, values : including the palette and its shape."""
        spectra = len(target.color_attachments)
        draws = [
            Draw(target, box, {"ROWS_A_CALL": len(some), "SPECTRA": spectra}, some.start)
            for some in _shared(layer, MOST_FOLDED)
        ]
        self._gather(draws, layer, filtered, samplers, values)

    def _gather(
        self,
        draws: Sequence[Draw],
        layer: SpreadLayer,
        filtered: bool,
        samplers: Mapping[str, moderngl.Texture],
        values: Mapping[str, object],
    ) -> None:
        form, scratch = layer.form, Owner(self.context)
        made = form.shader(filtered)
        sizes = {"LOBES": form.count, "BENT": form.bent, "FIELDS": _fields(layer), **made.sizes}
        sizes |= {"MIPMAPPED": 1} if filtered else {}
        sizes |= {"USES_UV": 1} if form.uses_uv else {}
        given = {
            **made.uniforms,
            **values,
            # Row-major data read as column-major by GL: the transpose.
            "map_from_world": tuple(layer.world_from_map.reshape(-1)),
            "scale": layer.scale,
            "lobes": sizes["LOBES"],
            "moments": form.bent,
            "rows": _rows(layer),
        }
        gathered, shadows = layer.gathered, layer.shadows
        if isinstance(gathered, IndirectLight):
            first = layer.fields.start
            lights = [self._kept(gathered, first, lambda: indirect_tables(self.context, gathered, layer.fields))]
        elif isinstance(gathered, GatheredPanel):
            lights = [panel_tables(self.context, gathered)]
        else:
            first = layer.fields.start
            lights = [self._kept(gathered, first, lambda: light_tables(self.context, gathered, layer.fields))]
        if shadows is not None:
            visibility, bright = shadows.visibility, shadows.bright
            lights.append(self._kept(visibility, 0, lambda: visibility_tables(self.context, visibility)))
            first = layer.fields.start
            if bright is not None:
                lights.append(self._kept(bright, first, lambda: bright_tables(self.context, bright, layer.fields)))
                hidden = shadows.hidden
                lights.append(
                    self._kept(hidden, first, lambda: hidden_tables(self.context, hidden, visibility, layer.fields))
                )
        try:
            textures = {name: scratch.texels(texels) for name, texels in made.textures.items()}
            for one in draws:
                numbers = {**given, "first_row": one.first_row}
                whole = {**sizes, **one.written}
                self.passes.gather(one.target, one.scissor, whole, made, lights, {**samplers, **textures}, numbers)
        finally:
            scratch.release()

    def _kept(self, of: object, which: int, made: Callable[[], LightTables]) -> LightTables:
        """Return the cached tables of an object, made on first use."""
        key = id(of), which
        # The last used table moves to the end, so that repeated rotations of a light do not evict its own map.
        found = self._tables.pop(key, None)
        if found is None:
            if len(self._tables) >= _MOST_TABLES:
                self._tables.pop(next(iter(self._tables)))[1].owner.release()
            found = of, made()
        self._tables[key] = found
        return found[1]


def _fields(layer: SpreadLayer) -> int:
    """Count the fields of a layer's light."""
    return layer.fields.stop - layer.fields.start


def _rows(layer: SpreadLayer) -> int:
    """Count the rows of four terms per field."""
    return layer.rank // 4 // _fields(layer)


def _shared(layer: SpreadLayer, most: int) -> list[range]:
    """Distribute these rows among draw calls of at most `most` rows of all fields together."""
    rows, a_call = _rows(layer), max(1, most // _fields(layer))
    return [range(start, min(start + a_call, rows)) for start in range(0, rows, a_call)]
