"""Environment form of surfaces of maps: slices of facets and body at each texel's roughness, times its colours."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float

from ...spectral.palette import Palette
from ..core.environment_form import BENDS, EnvironmentForm, Lobes
from ..core.points import Points
from ..core.terms import TermShader
from ..slices.view_slices import LAST
from .coat import COAT_F0, alike
from .facet_slices import KINDS, LOBES, RATIO, FacetSlices, facet_slices
from .facets import turned_to, upright
from .map_levels import WIDENED, wider
from .map_planes import OWN_SHARE, TAPS, MapPlanes, PlaneLayout
from .map_set import ROUNDING
from .stretched import LEAST_HEIGHT, PARTS, RINGS, ROUND, TABLE, axes_of, parts_of, sent_on, shadowed
from .texels import level_at, look_up

# Slope of the logistic curve that is nearest to a normal distribution.
_LOGISTIC = 1.702


@dataclass(frozen=True, eq=False)
class MappedSlices(EnvironmentForm):
    """Slices in the frame of each texel's normal, the viewer above its x.

    Facets that are wider along one axis are a sum of `PARTS` isotropic ones that lean along it (`stretched`), each with
    its own slice; their total is that of facets with alpha^2 = tr S / 2, times the ratio that S makes. If roughness
    results from varying normals, from afar, facets of maps without such axes are approximated as isotropic, as wide as
    the ellipse of the same area, alpha^4 = det S. A texel that leans away from the viewer is invisible, as under
    directional lights. Light from below the mesh's own horizon is removed from each Gaussian by the fraction of it
    there, and from cosines by the loss under uniform light.

    If points have a footprint on the texture, its numbers are means over the places that `MapPlanes` looks up in it,
    and the variation of normals among those widens the facets.
    """

    maps: MapPlanes
    bent = BENDS

    @property
    def count(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Number of Gaussians, for alphas on both sides; `shader` tells if there is a single alpha."""
        return 2 * LOBES * (self.parts + self.maps.layout.coated)

    @cached_property
    def parts(self) -> int:
        """`PARTS` if any texel's facets may be wider along one axis, else 1."""
        layout = self.maps.layout
        start = layout.starts["spread"]
        xx, xy, yy = layout.columns[start : start + 3]
        alike = xx == yy and (xx >= 0 or layout.constants[start] == layout.constants[start + 2])
        return 1 if alike and xy < 0 and layout.constants[start + 1] == 0.0 else PARTS

    @property
    def uses_uv(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        """True if texels differ."""
        return self.maps.uses_uv

    @property
    def palette(self) -> Palette:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Palette of the maps."""
        return self.maps.palette

    def lobes(self, points: Points) -> Lobes:
        """Implement `EnvironmentForm.lobes`."""
        numbers, layout, filtered, more = self._numbers(points)

        def kind(name: str, count: int = 1) -> np.ndarray:
            return layout.numbers(numbers, name, count)

        def normals(name: str, up: str) -> np.ndarray:
            lean = kind(name, 2)
            return np.concatenate([lean, kind(up)], axis=1) if filtered else upright(lean)

        normal, covers, rank = normals("normal", "up"), kind("covers"), layout.rank
        length = np.linalg.norm(normal, axis=1, keepdims=True) if filtered else np.ones((len(points), 1))
        normal = normal / length
        if not filtered:
            covers = (covers >= self.maps.cutoff - ROUNDING).astype(np.float64)
        covers = np.ones_like(covers) if self.maps.cut else covers
        coat = kind("coat")[:, 0] if layout.coated else None
        frame, theta_o = _frame(normal, points.wo)
        seen = (np.sum(normal * points.wo, axis=1, keepdims=True) > 0.0) * covers
        spread = kind("spread", 3) + (kind("differ", 3) + more["normal"] if filtered else 0.0)
        spread = np.broadcast_to(spread, (len(points), 3))
        if self.parts > 1:
            directions, sharpness, values = self._stretched(filtered, spread, normal, frame, theta_o, points.wo, coat)
        else:
            a, b, c = np.moveaxis(spread, -1, 0)
            directions, sharpness, values = self._slices(filtered).at(theta_o, (a * c - b * b) ** 0.25, coat)
            # Above the mesh's horizon, beside what is above the texel's, which slices know already.
            height = np.einsum("nqi,ni->nq", directions, frame[:, :, 2])
            free = _above(height, sharpness) / _above(directions[..., 2], sharpness)
            values[:, : sharpness.shape[1]] *= np.minimum(free, 1.0)[..., None]
        count = sharpness.shape[1]
        values[:, count:] *= 0.5 * (1.0 + normal[:, 2])[:, None, None]
        # The texels of a body together gather as their mean normal, which is shorter.
        body, rest, facet = (kind(name, rank) * seen for name in ("body", "rest", "facet"))
        out = np.zeros((*values.shape[:2], rank + 1))
        out[..., :rank] = values[..., :1] * (body * length)[:, None] + values[..., 1:2] * (rest * length)[:, None]
        out[..., :rank] += values[..., 2:3] * facet[:, None]
        out[..., rank] = values[..., 3] * (kind("edge") * seen)
        if coat is None:
            return Lobes(directions, sharpness, out[:, :count], out[:, count:], frame)
        normal, spread = normals("coat_normal", "coat_up"), alike(kind("coat_spread")[:, 0])
        spread += kind("coat_differ", 3) + more["coat_normal"] if filtered else 0.0
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        over = self._coat(filtered, coat * covers[:, 0], np.broadcast_to(spread, (len(points), 3)), normal, points.wo)
        value = np.zeros((len(points), over[2].shape[1] - BENDS, rank + 1))
        value[..., rank], out[:, count:, rank] = over[2][:, :-BENDS], out[:, count:, rank] + over[2][:, -BENDS:]
        value = np.concatenate([out[:, :count], value], axis=1)
        directions = np.concatenate([directions, over[0] @ frame.swapaxes(1, 2)], axis=1)
        return Lobes(directions, np.concatenate([sharpness, over[1]], axis=1), value, out[:, count:], frame)

    def _coat(
        self,
        filtered: bool,
        coat: Float[np.ndarray, " N"],
        spread: Float[np.ndarray, "N 3"],
        normal: Float[np.ndarray, "N 3"],
        wo: Float[np.ndarray, "N 3"],
    ) -> tuple[Float[np.ndarray, "N Q 3"], Float[np.ndarray, "N Q"], Float[np.ndarray, "N QB"]]:
        """Compute the light gathered by the coat's own facets, in the frame of the mesh.

        The cosine term is aligned with that of the layer below.
        """
        own, theta = _frame(normal, wo)
        a, b, c = np.moveaxis(spread, -1, 0)
        slices = self._slices_of("coat_spread", "coat_normal", "coat_differ", filtered)
        axes, sharpness, values = slices.at(np.minimum(theta, 0.5 * np.pi), (a * c - b * b) ** 0.25)
        seen = coat * (np.sum(normal * wo, axis=1) > 0.0)
        value, count = (COAT_F0 * values[..., 2] + values[..., 3]) * seen[:, None], sharpness.shape[1]
        mesh = axes @ own
        free = _above(mesh[..., 2], sharpness) / _above(axes[..., 2], sharpness)
        value[:, :count] *= np.minimum(free, 1.0)
        value[:, count:] *= 0.5 * (1.0 + normal[:, 2:])
        return mesh, sharpness, value

    def _stretched(
        self,
        filtered: bool,
        spread: Float[np.ndarray, "N 3"],
        normal: Float[np.ndarray, "N 3"],
        frame: Float[np.ndarray, "N 3 3"],
        theta_o: Float[np.ndarray, " N"],
        wo: Float[np.ndarray, "N 3"],
        coat: Float[np.ndarray, " N"] | None,
    ) -> tuple[Float[np.ndarray, "N Q 3"], Float[np.ndarray, "N Q"], Float[np.ndarray, "N QB 4"]]:
        """Compute the slices of all parts, in the frame of the texel's normal, above both horizons."""
        slices = self._slices(filtered)
        normals, alphas, shares = parts_of(spread, normal, wo)
        mean = np.sqrt(0.5 * (spread[:, 0] + spread[:, 2]))
        whole = slices.energy(theta_o, mean, coat)
        (to,), (wide, narrow, axis) = turned_to(normal, wo), axes_of(spread)
        whole[:, 2:] *= sent_on(wide, narrow, axis, to) / sent_on(mean, mean, axis, to)
        total, bent, found = np.zeros_like(whole), np.zeros((len(wo), BENDS, KINDS)), []
        for part in range(PARTS):
            own, theta = _frame(normals[:, part], wo)
            # A part is not seen from below.
            theta = np.minimum(theta, 0.5 * np.pi)
            axes, sharpness, values = slices.at(theta, alphas[:, part], coat)
            share, count = shares[:, part, None], sharpness.shape[1]
            mesh = axes @ own
            directions = mesh @ frame.swapaxes(1, 2)
            # Light below the texel's horizon goes elsewhere, light below the mesh's is lost.
            known = _above(axes[..., 2], sharpness)
            above, free = (np.minimum(_above(to[..., 2], sharpness) / known, 1.0) for to in (directions, mesh))
            (local,) = turned_to(np.repeat(normal, count, axis=0), mesh.reshape(-1, 3))
            there = shadowed(local, np.repeat(spread, count, axis=0)).reshape(sharpness.shape)
            there /= shadowed(axes, alike(alphas[:, part] ** 2)[:, None])
            lost = np.einsum("nq,nqk->nk", 1.0 - above * there, values[:, :count])
            values[:, :count, 2:] *= there[..., None]
            total += share * (slices.energy(theta, alphas[:, part], coat) - lost)
            bent += share[..., None] * values[:, count:]
            gaussians = values[:, :count] * (share * np.minimum(above, free))[..., None]
            found.append((directions, sharpness, gaussians))
        directions, sharpness, gaussians = (np.concatenate(each, axis=1) for each in zip(*found, strict=True))
        values = np.concatenate([gaussians, bent], axis=1)
        # Rescale the facets alone: the body's total is the same however parts lean.
        values[..., 2:] *= np.divide(whole, total, out=np.zeros_like(whole), where=total > 0.0)[:, None, 2:]
        return directions, sharpness, values

    def _numbers(
        self, points: Points
    ) -> tuple[Float[np.ndarray, "N P"], PlaneLayout, bool, dict[str, Float[np.ndarray, "_ 3"]]]:
        """Look up the planes at each point: numbers, layout, whether they are means, and the widening by normals.

        Means have coverage as a fraction; the widening is that of the spread about each kind of normal.
        """
        maps: MapPlanes = self.maps
        none: dict[str, np.ndarray] = {"normal": np.zeros((1, 3)), "coat_normal": np.zeros((1, 3))}
        if not maps.uses_uv:
            return np.zeros((len(points), 0)), maps.layout, False, none
        assert points.uv is not None
        uv, wrap = maps.placement.of(points.uv), maps.placement.wrap
        if points.spans is None or points.footprint is None:
            return look_up(maps.planes, uv, wrap), maps.layout, False, none
        levels, layout = maps.levels
        height, width, _ = maps.planes.shape
        spanned = points.footprint * maps.placement.scale
        level = level_at(spanned / TAPS, height, width, len(levels) - 1)
        fine = np.minimum(level.astype(np.int64), max(len(levels) - 2, 0))
        covers, total = layout.columns[layout.starts["covers"]], np.zeros((len(points), levels[0].shape[2]))
        moments = {name: np.zeros((len(points), 6)) for name, _, _ in layout.bumps}
        there = np.zeros((len(points), 1))

        def add(found: np.ndarray, share: np.ndarray, here: np.ndarray | slice) -> None:
            there[here] += share
            total[here] += share * found
            for name, up, _ in layout.bumps:
                mean = layout.numbers(found, name, 2), layout.numbers(found, up, 1)
                x, y = np.moveaxis(mean[0], -1, 0)
                second = np.stack([x * x, x * y, y * y], axis=-1)
                moments[name][here] += share * np.concatenate([*mean, second], axis=1)

        for number in np.unique(fine):
            here = np.flatnonzero(fine == number)
            part = (level[here] - number)[:, None]
            for across, down in np.ndindex(TAPS, TAPS):
                along = [(tap + 0.5) / TAPS - 0.5 for tap in (across, down)]
                place = uv[here] + along[0] * spanned[here, 0] + along[1] * spanned[here, 1]
                found = self._level(int(number), place)
                if part.any():
                    found += part * (self._level(int(number) + 1, place) - found)
                share = found[:, covers : covers + 1] if covers >= 0 else np.ones((len(here), 1))
                add(found, share, here)
        if maps.cut:
            # The point itself, as in `MapPlanes`.
            add(self._level(0, uv), np.full((len(points), 1), OWN_SHARE), slice(None))
        whole = np.where(there > 0.0, there, 1.0)
        total /= whole
        # Placeholders in holes, where their weight is 0.
        for name, up, _ in layout.bumps:
            first, last = (layout.columns[layout.starts[one]] for one in (name, up))
            mean = np.where(there > 0.0, moments[name] / whole, (0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
            total[:, [first, first + 1, last]], none[name] = mean[:, :3], wider(mean)
        for name, number in (("spread", (1.0, 0.0, 1.0)), ("coat_spread", (1.0,)))[: 1 + layout.coated]:
            first = layout.columns[layout.starts[name]]
            if first >= 0:
                total[there[:, 0] <= 0.0, first : first + len(number)] = number
        if covers >= 0:
            total[:, covers] = there[:, 0] / TAPS**2
        return total, layout, True, none

    def _level(self, number: int, uv: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N P"]:
        """Look up one level; on level 0 coverage is all or nothing."""
        levels, layout = self.maps.levels
        found, column = look_up(levels[number], uv, self.maps.placement.wrap), layout.columns[layout.starts["covers"]]
        if number == 0 and column >= 0:
            found[:, column] = found[:, column] >= self.maps.cutoff - ROUNDING
        return found

    def _slices(self, filtered: bool) -> FacetSlices:
        """Return the slices for the range of alphas; with wider ones if `filtered`."""
        return self._slices_of("spread", "normal", "differ", filtered)

    def _slices_of(self, name: str, normal: str, differ: str, filtered: bool) -> FacetSlices:
        """Return the slices for the range of alphas of the facets, or of the coat's."""
        levels, layout = self.maps.levels if filtered and self.maps.uses_uv else ([self.maps.planes], self.maps.layout)
        low, high, coat = [], [], name != "spread"
        parts = 1 if coat else self.parts
        for level in levels:
            texels = level.reshape(level.shape[0] * level.shape[1], level.shape[2])
            spread = layout.numbers(texels, name, 1 if coat else 3).astype(np.float64)
            spread = alike(spread[:, 0]) if coat else spread
            if len(layout.columns) > layout.starts["up"]:
                spread += layout.numbers(texels, differ, 3)
            a, b, c = np.moveaxis(spread, -1, 0)
            # The middle part is the narrowest.
            narrow = (a * c - b * b) / (0.5 * (a + c) + np.hypot(0.5 * (a - c), b)) if parts > 1 else 0.0
            low.append((np.sqrt(narrow) if parts > 1 else (a * c - b * b) ** 0.25).min())
            # Between texels a matrix may have a larger determinant than both, but half its trace is no less than that.
            high.append(np.sqrt(0.5 * (a + c)).max())
        if filtered and self.maps.uses_uv and layout.columns[layout.starts[normal]] >= 0:
            # The spread of normals is no more than their lean.
            leans = layout.numbers(levels[0].reshape(-1, levels[0].shape[2]), normal, 2)
            high.append(np.hypot(max(high), np.sqrt(0.5 * WIDENED * np.sum(leans**2, axis=1).max())))
        return facet_slices(float(min(low)), float(max(high)), layout.coated and not coat)

    def shader(self, filtered: bool = False) -> TermShader:
        """Return the maps' look-up, with the slices in two textures, a row per viewer and alpha, a coat's below."""
        filtered &= self.maps.uses_uv
        own, slices = self.maps.shader(filtered), self._slices(filtered)
        alphas, polar, count = slices.widths.shape
        sizes = {"ALPHAS": min(alphas, 2), "POLAR": polar, "PARTS": self.parts, "RATIOS": len(TABLE)}
        uniforms = {"last": 0.5 * np.pi - LAST, "logistic": _LOGISTIC, "widened": WIDENED}
        uniforms |= {"first_alpha": float(slices.alphas[0]), "steps": float(1.0 / np.log(RATIO)), "alphas": alphas}
        axes, tabled = slices.texels(self.parts > 1)
        lobes = self.parts * count * min(alphas, 2)
        if self.maps.layout.coated:
            coat = self._slices_of("coat_spread", "coat_normal", "coat_differ", filtered)
            more_axes, more = coat.texels(self.parts > 1)
            sizes |= {"COLUMNS": more.shape[1], "COAT_LOBES": count * min(len(coat.alphas), 2)}
            uniforms |= {"coat_first_alpha": float(coat.alphas[0]), "coat_alphas": len(coat.alphas)}
            uniforms["coat_row"] = len(axes)
            # Under a coat there are two more numbers, beside the others; the coat's own are under none.
            more = np.concatenate([more, np.zeros_like(more)], axis=1)
            axes, tabled = np.concatenate([axes, more_axes]), np.concatenate([tabled, more])
            lobes += sizes["COAT_LOBES"]
        textures = {"axes": axes, "slices": tabled}
        if self.parts > 1:
            # A row a rho, of two texels: middles and shares, widths and the logarithm of rho.
            uniforms |= {"least_height": LEAST_HEIGHT, "rings": [tuple(ring) for ring in RINGS.T.tolist()]}
            sizes |= {"RINGS": RINGS.shape[1], "ROUND": ROUND}
            textures["leaning"] = TABLE.reshape(len(TABLE), 2, 4).astype(np.float32)
        return replace(
            own,
            file=Path(__file__).with_name("mapped_slices.glsl"),
            sizes={**own.sizes, "LOBES": lobes, **sizes},
            textures={**own.textures, **textures},
            uniforms={**own.uniforms, **uniforms},
        )

    @property
    def key(self) -> tuple:
        """Key of the maps."""
        return "slices", *self.maps.key


def _frame(
    normal: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]
) -> tuple[Float[np.ndarray, "N 3 3"], Float[np.ndarray, " N"]]:
    """Compute axes, in rows, about a normal, with x towards the viewer; and the viewer's angle from it, in radians."""
    height = np.sum(normal * wo, axis=1)
    level = wo - height[:, None] * normal
    length = np.linalg.norm(level, axis=1)
    # Straight above every plane is as good: x goes along the mesh's.
    zero = np.zeros_like(height)
    other = np.stack([normal[:, 2], zero, -normal[:, 0]], axis=1)
    flat = np.linalg.norm(other, axis=1)
    other = np.where(flat[:, None] > 0.0, other / np.where(flat > 0.0, flat, 1.0)[:, None], (1.0, 0.0, 0.0))
    x = np.where(length[:, None] > 0.0, level / np.where(length > 0.0, length, 1.0)[:, None], other)
    return np.stack([x, np.cross(normal, x), normal], axis=1), np.arctan2(length, height)


def _above(height: Float[np.ndarray, "N Q"], sharpness: Float[np.ndarray, "N Q"]) -> Float[np.ndarray, "N Q"]:
    """Approximate the fraction of a Gaussian above a horizon, from the height of its axis (the sine)."""
    return 1.0 / (1.0 + np.exp(np.minimum(-_LOGISTIC * np.sqrt(sharpness) * height, 80.0)))
