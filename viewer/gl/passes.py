"""Passes of the GL renderer: visibility, incident light, shading, and texture coordinates.

`PROGRAMS` lists every pair of shader files with its `#define`d sizes, except `shade.frag`, which each fast form
completes; a test compiles them all.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from ...materials.core.fast import TermShader
from ..render import shadows
from ..render.geometry import LightGeometry
from ..render.raster import SUBSTEPS, TileWindow, WindowTriangles
from ..render.view import View
from . import resources
from .full_screen import set_values
from .light_textures import LightTables
from .programs import CachedProgram, Programs
from .shaders import ShaderError

if TYPE_CHECKING:
    import moderngl

# Spectra per draw call: OpenGL 4.1 guarantees eight targets, but with four the shader stays in registers.
MOST_SPECTRA = 4
# Targets of four terms per draw call, for the same reason.
MOST_QUADS = 4
# Rows of four terms per draw call if folded in the shader, in a local array.
MOST_FOLDED = 16
# Limit of loop iterations of a shader: Mesa's llvmpipe aborts after 65,535, and the image is too dark.
_MOST_STEPS = 40_000
# Loop iterations per sample for area or environment light.
_STEPS_OF_LIGHT = 1500

_GEOMETRY_SIZES: dict[str, int | float] = {
    "SUBSTEPS": float(SUBSTEPS),
    "TRIANGLE_TEXELS": resources.TRIANGLE_TEXELS,
    "TRIANGLES_A_ROW": resources.TRIANGLES_A_ROW,
    "CORNER_TEXELS": resources.CORNER_TEXELS,
    "CORNERS_A_ROW": resources.CORNERS_A_ROW,
    "OCCLUDERS_A_ROW": resources.OCCLUDERS_A_ROW,
    "ROW_LENGTH": resources.ROW_LENGTH,
    "OUTLINE_RAMP": shadows.OUTLINE_RAMP,
    "CONTACT": shadows.CONTACT,
    "ROUNDING": shadows.ROUNDING,
}
FOLDED = tuple({"SPECTRA": count} for count in range(1, MOST_SPECTRA + 1))
KEPT = tuple({"QUADS": count} for count in range(1, MOST_QUADS + 1))
PROGRAMS: tuple[tuple[str, str, dict[str, int | float]], ...] = (
    ("visibility.vert", "visibility.frag", _GEOMETRY_SIZES),
    *(
        ("fullscreen.vert", "light.frag", {**kind, **mipmapped, **_GEOMETRY_SIZES})
        for mipmapped in ({}, {"MIPMAPPED": 1})
        for kind in ({"PARALLEL": 0}, {"PARALLEL": 1}, {"FREE": 1})
    ),
    (
        "fullscreen.vert",
        "uv.frag",
        {"UV_TEXELS": resources.UV_TEXELS, "UVS_A_ROW": resources.UVS_A_ROW, **_GEOMETRY_SIZES},
    ),
    ("fullscreen.vert", "frames.frag", _GEOMETRY_SIZES),
    ("fullscreen.vert", "coverage.frag", {}),
    *(("fullscreen.vert", "fold.frag", {**kept, **folded}) for kept in KEPT for folded in FOLDED),
)


def _shared_samples(samples: object, steps: int) -> list[tuple[int, int]]:
    """Distribute the samples of a pixel among draw calls within the limit of iterations: (first, one past the last)."""
    assert isinstance(samples, int)
    count, some = samples**2, max(1, _MOST_STEPS // steps)
    return [(first, min(first + some, count)) for first in range(0, count, some)]


class Passes:
    """Passes and their programs, compiled on first use."""

    def __init__(self, context: moderngl.Context) -> None:
        self.context = context
        self.owner = resources.Owner(context)
        #: Programs, also of other passes after `use_programs_of`.
        self.programs = Programs(context)
        self._own = self.programs
        self._named: set[tuple[Path, tuple[str, ...]]] = set()
        # Positions of the last scene, and the textures of its corners.
        self._corners: tuple[np.ndarray, resources.Owner, moderngl.Texture] | None = None
        self._shadows: dict[int, tuple[LightGeometry, resources.Owner, dict[str, moderngl.Texture]]] = {}

    def use_programs_of(self, other: Passes) -> None:
        """Share the programs of another instance, which must live longer."""
        self.programs = other.programs

    def release(self) -> None:
        """Free the programs unless they are shared."""
        self._own.release()
        self.keep_shadows(())
        self._release_corners()
        self.owner.release()

    def triangles(self, owner: resources.Owner, view: View, triangles: WindowTriangles) -> resources.TriangleTables:
        """Upload triangles, owned by `owner`; data that is independent of the view is reused."""
        scene = view.scene
        if self._corners is None or self._corners[0] is not scene.positions:
            self._release_corners()
            kept = resources.Owner(self.context)
            table = kept.table(scene.corner_texels, resources.CORNERS_A_ROW, resources.CORNER_TEXELS)
            self._corners = scene.positions, kept, table
        texels = resources.triangle_texels(triangles, view.side, view.handedness)
        return resources.TriangleTables(
            owner.table(texels, resources.TRIANGLES_A_ROW, resources.TRIANGLE_TEXELS),
            self._corners[2],
            owner.table(resources.piece_texels(scene, triangles), resources.CORNERS_A_ROW, resources.CORNER_TEXELS),
            triangles.parent,
            triangles.key_base,
            triangles.key_shift,
        )

    def visibility(
        self, owner: resources.Owner, window: TileWindow, triangles: resources.TriangleTables
    ) -> moderngl.Texture:
        """Draw the index + 1 of the triangle at each sample (R32F), rows from the top; owned by `owner`."""
        context, size = self.context, (window.width, window.height)
        seen = owner.texture(size, 1)
        scratch = resources.Owner(context)
        try:
            target = scratch.keep(context.framebuffer([seen], scratch.keep(context.depth_renderbuffer(size))))
            self._begin(target, size)
            target.clear(depth=0.0)
            if len(triangles.numbers):
                made, without_buffers = self._made("visibility.vert", "visibility.frag")
                context.enable_only(context.DEPTH_TEST)
                context.depth_func = ">"
                half_size = tuple(0.5 * SUBSTEPS * side for side in size)
                values = {"key_base": triangles.key_base, "key_shift": triangles.key_shift, "half_size": half_size}
                set_values(made, values, {"triangles": triangles.triangles})
                without_buffers.render(context.TRIANGLES, vertices=3 * len(triangles.numbers))
        finally:
            scratch.release()
        return seen

    def coverage(self, owner: resources.Owner, seen: moderngl.Texture, samples: int) -> moderngl.Texture:
        """Draw the share of each pixel's samples that see a surface (R32F), owned by `owner`.

        samples : along a side of a pixel.
        """
        found = owner.texture((seen.width // samples, seen.height // samples), 1)
        scratch = resources.Owner(self.context)
        try:
            shares = (np.arange(samples**2 + 1) / samples**2).astype(np.float32)
            table = scratch.texture((len(shares), 1), 1, shares.tobytes())
            self._fill([found], "coverage.frag", {"samples": samples}, {"seen": seen, "shares": table})
        finally:
            scratch.release()
        return found

    def light(
        self,
        owner: resources.Owner,
        view: View,
        light: LightGeometry,
        seen: moderngl.Texture,
        triangles: resources.TriangleTables,
        mipmapped: bool = False,
        free: moderngl.Texture | None = None,
    ) -> tuple[moderngl.Texture, ...]:
        """Draw angles and irradiance of one light at every sample (io, hd, azimuths), owned by `owner`.

        `mipmapped` adds the spans of samples in the angles (io, hd). `free` : visibility at each sample, if known.
        """
        made_of = (4, 4, 2, 4, 4) if mipmapped else (4, 4, 2)
        outputs = tuple(owner.texture(seen.size, components) for components in made_of)
        scratch = resources.Owner(self.context)
        try:
            tables = {"free": free} if free else self._shadow_tables(light)
            lit = scratch.table(view.lit(light)[triangles.numbers].astype(np.float32), resources.ROW_LENGTH)
            kind = {"FREE": 1} if free else {"PARALLEL": int(light.shadows.parallel)}
            kind |= {"MIPMAPPED": 1} if mipmapped else {}
            values = {
                "eye": tuple(view.eye),
                "perspective": view.perspective,
                "resolution": light.shadows.resolution,
                # Column-major.
                "view_from_world": tuple(light.shadows.basis.T.reshape(-1)),
                "view_origin": tuple(light.shadows.origin),
                "convergence": light.shadows.convergence,
                "light": tuple(light.vector),
                "irradiance": light.irradiance / view.camera.samples**2,
            }
            samplers = {"seen": seen, "lit": lit, **triangles.samplers, **tables}
            self._fill(outputs, "light.frag", values, samplers, **kind)
        finally:
            scratch.release()
        return outputs

    def uv(
        self,
        owner: resources.Owner,
        corners: Float[np.ndarray, "T 3 2"],
        seen: moderngl.Texture,
        triangles: resources.TriangleTables,
    ) -> tuple[moderngl.Texture, moderngl.Texture]:
        """Draw texture coordinates (RG32F) and footprints (RGBA32F: change to the next column of samples, then to the
        next row) at every sample, owned by `owner`; 0 without a surface or without uv. Only textured materials need it.

        corners : of the window's triangles, any linear attribute.
        """
        outputs = owner.texture(seen.size, 2), owner.texture(seen.size, 4)
        scratch = resources.Owner(self.context)
        try:
            uvs = scratch.table(resources.uv_texels(corners), resources.UVS_A_ROW, resources.UV_TEXELS)
            self._fill(outputs, "uv.frag", {}, {"seen": seen, "uvs": uvs, **triangles.samplers})
        finally:
            scratch.release()
        return outputs

    def frames(
        self, owner: resources.Owner, view: View, seen: moderngl.Texture, triangles: resources.TriangleTables
    ) -> tuple[moderngl.Texture, ...]:
        """Draw tangent, bitangent and normal at every sample (RGBA32F), each with a component of the local direction to
        the viewer, and the position; owned by `owner`. Only area, environment and indirect light need it.
        """
        outputs = tuple(owner.texture(seen.size, 4) for _ in range(4))
        values = {"eye": tuple(view.eye), "perspective": view.perspective}
        self._fill(outputs, "frames.frag", values, {"seen": seen, **triangles.samplers})
        return outputs

    def gather(
        self,
        target: moderngl.Framebuffer,
        scissor: tuple[int, int, int, int] | None,
        sizes: Mapping[str, int],
        terms: TermShader,
        light: Sequence[LightTables],
        samplers: Mapping[str, moderngl.Texture],
        values: Mapping[str, object],
    ) -> None:
        """Add the area, environment or indirect light gathered by a material to `target`, whose attachments are folded
        images if `sizes` has SPECTRA, else four terms each (ROWS_A_CALL for each of FIELDS).
        """
        self._check_names(terms)
        whole = {**sizes, "ROW_LENGTH": resources.ROW_LENGTH}
        textures, uniforms = dict(samplers), dict(values)
        for one in light:
            whole |= one.sizes
            textures |= one.textures
            uniforms |= one.uniforms
        made, everywhere = self._full_screen("gather.frag", terms.file, **whole)
        for some in _shared_samples(uniforms["samples"], terms.steps + _STEPS_OF_LIGHT):
            self.draw_layer(made, everywhere, target, scissor, textures, {**uniforms, "some_samples": some})

    def shade(
        self,
        target: moderngl.Framebuffer,
        scissor: tuple[int, int, int, int] | None,
        written: Mapping[str, int],
        terms: TermShader,
        samplers: Mapping[str, moderngl.Texture],
        values: Mapping[str, object],
    ) -> None:
        """Add one summand under one light to `target`, whose attachments are, according to `written`, {"SPECTRA": n}
        images or {"QUADS": n} times four terms.
        """
        self._check_names(terms)
        made, everywhere = self._full_screen("shade.frag", terms.file, **terms.sizes, **written)
        for some in _shared_samples(values["samples"], terms.steps):
            given = {**terms.uniforms, **values, "some_samples": some}
            self.draw_layer(made, everywhere, target, scissor, samplers, given)

    def _check_names(self, terms: TermShader) -> None:
        """Check that a form's GLSL has all names set for it, since GL would silently ignore unknown ones."""
        names = (*terms.uniforms, *terms.textures)
        if (terms.file, names) in self._named:
            return
        words = _words(terms.file) if terms.file.is_file() else set(names)
        for name in names:
            if name not in words:
                raise ShaderError(f"{terms.file}: no uniform {name!r}, which its summand's `shader` gives")
        self._named.add((terms.file, names))

    def fold(
        self,
        target: moderngl.Framebuffer,
        box: tuple[int, int, int, int],
        spectra: int,
        quads: Sequence[moderngl.Texture],
        weights: Float[np.ndarray, "Q S3 4"],
        origin: tuple[int, int],
    ) -> None:
        """Fold cached terms of a box and add them to `target`, whose attachments are one image each.

        weights : X, Y and Z of the terms of each quad for each spectrum. origin : of the terms' first pixel.
        """
        made, everywhere = self._full_screen("fold.frag", QUADS=len(quads), SPECTRA=spectra)
        for unit, quad in enumerate(quads, 1):
            quad.use(unit)
        units: object = 1 if len(quads) == 1 else list(range(1, len(quads) + 1))
        values = {"terms": units, "origin": origin, "weights": weights.reshape(-1, 4).tolist()}
        self.draw_layer(made, everywhere, target, box, {}, values)

    def draw_layer(
        self,
        made: moderngl.Program,
        everywhere: moderngl.VertexArray,
        target: moderngl.Framebuffer,
        scissor: tuple[int, int, int, int] | None,
        samplers: Mapping[str, moderngl.Texture],
        values: Mapping[str, object],
    ) -> None:
        """Run a full-screen program with additive blending."""
        context = self.context
        self._begin(target, target.size)
        context.enable_only(context.BLEND)
        context.blend_equation = context.FUNC_ADD
        context.blend_func = context.ONE, context.ONE
        target.scissor = scissor
        set_values(made, values, samplers)
        everywhere.render(context.TRIANGLES, vertices=3)
        target.scissor = None

    def _fill(
        self,
        outputs: Sequence[moderngl.Texture],
        fragment: str,
        values: Mapping[str, object],
        samplers: Mapping[str, moderngl.Texture],
        **kind: int,
    ) -> None:
        """Fill textures of one size with a shader of `PROGRAMS`."""
        target = self.context.framebuffer(outputs)
        try:
            self._begin(target, target.size)
            self.context.enable_only(self.context.NOTHING)
            made, everywhere = self._full_screen(fragment, **kind)
            set_values(made, values, samplers)
            everywhere.render(self.context.TRIANGLES, vertices=3)
        finally:
            resources.release_target(target)

    def _begin(self, target: moderngl.Framebuffer, size: tuple[int, int]) -> None:
        target.use()
        target.scissor = None
        target.viewport = (0, 0, *size)

    def _release_corners(self) -> None:
        if self._corners is not None:
            self._corners[1].release()
        self._corners = None

    def keep_shadows(self, lights: Sequence[LightGeometry]) -> None:
        """Free the shadow tables of all lights but these."""
        for key in [key for key, (light, _, _) in self._shadows.items() if light not in lights]:
            self._shadows.pop(key)[1].release()

    def upload_shadows(self, light: LightGeometry) -> None:
        """Upload a light's shadow tables, as `light` would."""
        self._shadow_tables(light)

    def _shadow_tables(self, light: LightGeometry) -> dict[str, moderngl.Texture]:
        """Return the tables of `shadows.glsl`, cached for other cameras."""
        if id(light) not in self._shadows:
            grid, owner = light.shadows, resources.Owner(self.context)
            starts = grid.starts.astype(np.float32).view(np.int32)
            entries = np.stack([grid.entries.astype(np.int32), starts], axis=1)
            tables = {
                "occluders": owner.table(grid.corners.astype(np.float32), resources.OCCLUDERS_A_ROW, 3),
                "cells": owner.table(grid.first.astype(np.int32), resources.ROW_LENGTH),
                "entries": owner.table(entries, resources.ROW_LENGTH),
            }
            self._shadows[id(light)] = light, owner, tables
        return self._shadows[id(light)][2]

    def _full_screen(
        self, fragment: str, terms: Path | None = None, /, **sizes: int | float
    ) -> tuple[moderngl.Program, moderngl.VertexArray]:
        """Return a full-screen program, and its vertex array without buffers."""
        return self._made("fullscreen.vert", fragment, terms, **sizes)

    def _made(self, vertex: str, fragment: str, terms: Path | None = None, **sizes: int | float) -> CachedProgram:
        if terms is not None:
            return self.programs.of((vertex, fragment, tuple(sizes.items()), terms))
        # Linear programs come first, as the default without mip-mapping.
        for names in PROGRAMS:
            if names[:2] == (vertex, fragment) and sizes.items() <= names[2].items():
                return self.programs.of((vertex, fragment, tuple(names[2].items()), None))
        raise KeyError(f"{vertex} + {fragment} {sizes} is not in PROGRAMS")


def _words(file: Path) -> set[str]:
    """Collect the identifiers of a form's GLSL, and of its includes in the same folder."""
    text = file.read_text("utf-8")
    beside = [file.with_name(name) for name in re.findall(r'#include "([^"]+)"', text)]
    return set(re.findall(r"\w+", text)).union(*(_words(one) for one in beside if one.is_file()))
