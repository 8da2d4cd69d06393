"""Lights that spread on the GPU: what of them is kept there, and the draw calls that gather them."""

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

#: The samplers of a tile's frames, in the order of its textures.
FRAMES = ("tangent", "bitangent", "normal", "position", "standing", "faces")


# Tables that stay on the GPU, some 20 MB each.
_MOST_TABLES = 12


class Draw(NamedTuple):
    """A draw call: where to, which sizes of the shader say what is written, and the first of the rows of four terms.

    Rows are those of one field: a call writes the same ones of every field.
    """

    target: moderngl.Framebuffer
    scissor: tuple[int, int, int, int] | None
    written: Mapping[str, int]
    first_row: int


class GLGathering:
    """Gathers light for environment forms; the tables of the last few lights stay on the GPU."""

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
        """Write a layer's terms, four to each texture. samplers, values : what `gather.frag` reads of a tile."""
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
        """Add a layer, folded, to a picture of each spectrum; the palette and its shape are among what is given."""
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
            # Row by row what GL takes column by column: its transpose.
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
        """Return the tables of something, made when first asked for."""
        key = id(of), which
        # The table used last moves to the end: a light that is turned and turned does not drive its own map out.
        found = self._tables.pop(key, None)
        if found is None:
            if len(self._tables) >= _MOST_TABLES:
                self._tables.pop(next(iter(self._tables)))[1].owner.release()
            found = of, made()
        self._tables[key] = found
        return found[1]


def _fields(layer: SpreadLayer) -> int:
    """Count the fields of a light that a layer is of."""
    return layer.fields.stop - layer.fields.start


def _rows(layer: SpreadLayer) -> int:
    """Rows of four terms that it has of each field."""
    return layer.rank // 4 // _fields(layer)


def _shared(layer: SpreadLayer, most: int) -> list[range]:
    """Share those rows among draw calls of at most `most` rows of all fields together."""
    rows, a_call = _rows(layer), max(1, most // _fields(layer))
    return [range(start, min(start + a_call, rows)) for start in range(0, rows, a_call)]
