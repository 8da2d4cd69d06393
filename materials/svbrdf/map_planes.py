"""Terms of a surface of maps: the scattering of texels as planes of numbers, some of them coefficients of colour.

Body and facets share their spectra: with coefficients b (body), e (body at grazing), s (facets) and edge f of a texel,
the fall (1 - h.wi)^5 and the facets' D G / (4 cos cos) at its normal,

    term r = cos(theta_i) (((1 - fall) b_r + fall e_r) / pi + (1 - fall) s_r D G / (4 cos cos))
    last   = cos(theta_i) fall f D G / (4 cos cos),                                    whose spectrum is 1

A clear coat (`coat`) multiplies all terms by its transmission and adds its own reflection to the last.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...spectral.palette import Palette
from ..analytic.metallic_roughness import schlick
from ..core.axes import Frame
from ..core.fast import Summand, TermShader
from ..core.points import Points
from ..core.terms import Terms
from .coat import COAT_F0, alike, coat_over
from .facets import facets, turned_to, upright
from .map_levels import WIDENED, coat_from_afar, facets_apart, normals_from_afar, spread_from_afar
from .map_set import ROUNDING, WHOLE, Placement
from .texels import WRAPS, Wrap, level_at, levels_of, look_up, packed

#: Places looked up along each side of a sample's footprint, at the level whose texels lie as far apart.
TAPS = 4
# Numbers of a texel without a coat, beside its coefficients.
_UNCOATED = 7
#: Weight of a sample's own point in a surface with holes, beside 1 of each place.
OWN_SHARE = 1e-3
_TAPS = (np.arange(TAPS) + 0.5) / TAPS - 0.5


@dataclass(frozen=True)
class PlaneLayout:
    """Layout of the numbers of a texel, of R coefficients.

    body, rest, facets (R each), edge, normal (2), spread (3), covers; of a coat w, alpha^2 and normal (2); on levels
    beyond the first `up`, the z of the mean normal, and `differ` (3), the widening of the spread by varying normals,
    and the same of a coat.

    columns : the plane of each number; -1 if it is in `constants`, the same for all texels. coated : has a coat.
    """

    rank: int
    columns: tuple[int, ...]
    constants: tuple[float, ...]
    coated: bool = False

    @cached_property
    def starts(self) -> dict[str, int]:
        """Index of the first number of each kind."""
        kinds = {"body": self.rank, "rest": self.rank, "facet": self.rank, "edge": 1, "normal": 2, "spread": 3}
        kinds |= {"covers": 1} | ({"coat": 1, "coat_spread": 1, "coat_normal": 2} if self.coated else {})
        kinds |= {"up": 1, "differ": 3} | ({"coat_up": 1, "coat_differ": 3} if self.coated else {})
        return dict(zip(kinds, np.cumsum([0, *kinds.values()]).tolist(), strict=False))

    @property
    def bumps(self) -> list[tuple[str, str, str]]:
        """Names of normals that vary over texels, of the z of their means, and of the widening by them."""
        kinds = [("normal", "up", "differ"), ("coat_normal", "coat_up", "coat_differ")]
        return [kind for kind in kinds if kind[0] in self.starts and self.columns[self.starts[kind[0]]] >= 0]

    def numbers(self, texels: Float[np.ndarray, "N P"], name: str, count: int) -> Float[np.ndarray, "N K"]:
        """Return the numbers of one kind at points whose planes are `texels`."""
        start = self.starts[name]
        places = self.columns[start : start + count]
        if min(places) >= 0:
            return texels[:, list(places)]
        found = np.empty((len(texels), count))
        for at, (place, constant) in enumerate(zip(places, self.constants[start : start + count], strict=True)):
            found[:, at] = texels[:, place] if place >= 0 else constant
        return found


@dataclass(frozen=True, eq=False)
class MapPlanes(Summand):
    """Terms of all texels of a surface of maps.

    planes : (H,W,P) numbers that vary over texels, in float16 if `precision` is "half". layout : their meaning.
    palette : one entry of R + 1 spectra, 1/sr, the last of them 1. cutoff, placement : see `MapSet`.
    cut : points are never in holes, so that a footprint is averaged over its opaque part; else holes are black.
    """

    planes: np.ndarray
    layout: PlaneLayout
    palette: Palette
    cutoff: float = 0.0
    placement: Placement = WHOLE
    precision: Literal["single", "half"] = "single"
    frame: Frame = "io"
    cut: bool = False

    def __post_init__(self) -> None:
        expected = (1, self.layout.rank + 1)
        shape, most = self.planes.shape, max(self.layout.columns)
        fits = len(shape) == 3 and shape[0] * shape[1] > 0 and most < shape[2]
        counted = len(self.layout.columns) == len(self.layout.constants) == self.layout.starts["up"]
        if not (fits and counted) or (self.palette.entries, self.palette.rank) != expected:
            raise InputError("planes do not fit", field="planes", found=shape, expected=f"{most + 1} planes, one entry")

    @property
    def uses_uv(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        """True if texels differ."""
        return self.planes.shape[2] > 0

    @cached_property
    def levels(self) -> tuple[list[np.ndarray], PlaneLayout]:
        """Planes of each level, and their layout, which also has the z of mean normals and their variation."""
        layout, starts = self.layout, self.layout.starts
        columns, constants = list(layout.columns), list(layout.constants)
        for name in ("normal", "coat_normal")[: 1 + layout.coated]:
            x, y = layout.constants[starts[name] : starts[name] + 2]
            constants += [max(1.0 - x * x - y * y, 0.0) ** 0.5, 0.0, 0.0, 0.0]
            columns += [-1] * 4
        planes = self.planes.astype(np.float64)
        shape = planes.shape[:2]

        def kind(name: str, count: int) -> np.ndarray:
            return layout.numbers(planes.reshape(-1, planes.shape[2]), name, count).reshape(*shape, count)

        if (covers := columns[starts["covers"]]) >= 0:
            there = (kind("covers", 1) >= self.cutoff - ROUNDING).astype(np.float64)
            levels = [planes]
            for level in levels_of(np.concatenate([planes * there, there], axis=-1))[1:]:
                count = level[..., -1:]
                mean = np.divide(level[..., :-1], count, out=np.zeros_like(level[..., :-1]), where=count > 0)
                mean[..., covers] = count[..., 0]
                levels.append(mean)
        else:
            levels = levels_of(planes)
        added: list[tuple[str, list[np.ndarray]]] = []
        if max(columns[starts["spread"] : starts["spread"] + 3]) >= 0:
            added.append(("spread", spread_from_afar(kind("spread", 3))))
        if layout.coated and columns[starts["coat_spread"]] >= 0:
            added.append(("coat_spread", coat_from_afar(kind("coat_spread", 1), kind("coat", 1))))
        for normal, up, differ in layout.bumps:
            means, wider = normals_from_afar(kind(normal, 2))
            added += [(up, [mean[..., 2:] for mean in means]), (differ, wider)]
        for name, more in added:
            count, start, column = more[0].shape[2], starts[name], levels[0].shape[2]
            levels = [np.concatenate(both, axis=-1) for both in zip(levels, more, strict=True)]
            columns[start : start + count] = range(column, column + count)
        return levels, replace(layout, columns=tuple(columns), constants=tuple(constants))

    def terms(self, points: Points) -> Terms:
        """Implement `Summand.terms`, averaged over the footprint of points that have one."""
        lit = points.angles("io").scale
        some = np.flatnonzero(lit)
        here = points.chosen(some)
        value = np.zeros((len(points), self.rank))
        if self.uses_uv and here.spans is not None and here.footprint is not None:
            found = self._mean(here)
        else:
            none = np.zeros((len(here), 0))
            texels = look_up(self.planes, self._uv(here), self.placement.wrap) if self.uses_uv else none
            found = self._shown(texels, self.layout, here)
            found *= 1.0 if self.cut else self._covered(texels, self.layout, False)
        value[some] = found * lit[some, None]
        return Terms(value)

    def _uv(self, points: Points) -> Float[np.ndarray, "N 2"]:
        assert points.uv is not None
        return self.placement.of(points.uv)

    def _mean(self, points: Points) -> Float[np.ndarray, "N R"]:
        """Average over the footprint on the texture, at TAPS x TAPS places on the level of its scale."""
        levels, layout = self.levels
        assert points.footprint is not None
        uv, spanned = self._uv(points), points.footprint * self.placement.scale
        height, width, _ = self.planes.shape
        level = level_at(spanned / TAPS, height, width, len(levels) - 1)
        fine = level.astype(np.int64)
        total, there = np.zeros((len(points), self.rank)), np.zeros((len(points), 1))
        for number in np.unique(fine):
            here = np.flatnonzero(fine == number)
            chosen, part = points.chosen(here), (level[here] - number)[:, None]
            for across in _TAPS:
                for down in _TAPS:
                    place = uv[here] + across * spanned[here, 0] + down * spanned[here, 1]
                    texels = look_up(levels[number], place, self.placement.wrap)
                    share = self._covered(texels, layout, bool(number > 0))
                    found = share * self._shown(texels, layout, chosen, bool(number > 0))
                    if part.any():
                        texels = look_up(levels[number + 1], place, self.placement.wrap)
                        coarser = self._covered(texels, layout, True)
                        found += part * (coarser * self._shown(texels, layout, chosen, True) - found)
                        share = share + part * (coarser - share)
                    total[here] += found
                    there[here] += share
        if not self.cut:
            return total / TAPS**2
        # The point itself, which is no hole, counts a little; it counts alone if all places are holes.
        own = self._shown(look_up(levels[0], uv, self.placement.wrap), layout, points)
        return (total + OWN_SHARE * own) / (there + OWN_SHARE)

    def _covered(self, texels: Float[np.ndarray, "N P"], layout: PlaneLayout, coarse: bool) -> Float[np.ndarray, "N 1"]:
        """Return the coverage; of single texels all or nothing."""
        covers = layout.numbers(texels, "covers", 1)
        return covers if coarse else (covers >= self.cutoff - ROUNDING).astype(np.float64)

    def _shown(
        self, texels: Float[np.ndarray, "N P"], layout: PlaneLayout, points: Points, coarse: bool = False
    ) -> Float[np.ndarray, "N R"]:
        """Evaluate the terms at lit points with planes `texels`, without coverage; `coarse`: beyond level 0."""

        def kind(name: str, count: int = 1) -> np.ndarray:
            return layout.numbers(texels, name, count)

        lean, rank = kind("normal", 2), layout.rank
        if coarse:
            mean = np.concatenate([lean, kind("up")], axis=1)
            arriving = np.maximum(np.sum(mean * points.wi, axis=1), 0.0)
            normal = mean / np.linalg.norm(mean, axis=1, keepdims=True)
        else:
            normal = upright(lean)
            arriving = None
        wi, wo = turned_to(normal, points.wi, points.wo)
        above = (wi[:, 2] > 0) & (wo[:, 2] > 0)
        wi, wo = (np.where(above[:, None], w, (0.0, 0.0, 1.0)) for w in (wi, wo))
        fall = schlick(points.wi, points.wo)
        spread = kind("spread", 3)
        shine = facets_apart(wi, wo, spread, kind("differ", 3)) if coarse else facets(wi, wo, spread) * wi[:, 2]
        shine = shine * above
        lit = (wi[:, 2] if arriving is None else arriving) * above / np.pi
        out = np.empty((len(texels), rank + 1))
        out[:, :rank] = kind("body", rank) * ((1.0 - fall) * lit)[:, None]
        out[:, :rank] += kind("rest", rank) * (fall * lit)[:, None]
        out[:, :rank] += kind("facet", rank) * ((1.0 - fall) * shine)[:, None]
        out[:, rank] = kind("edge")[:, 0] * fall * shine
        if layout.coated:
            lean, differ = kind("coat_normal", 2), kind("coat_differ", 3) if coarse else None
            normal = np.concatenate([lean, kind("coat_up")], axis=1) if coarse else upright(lean)
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            spread = alike(kind("coat_spread")[:, 0])
            through, shine = coat_over(points, fall, kind("coat")[:, 0], normal, spread, differ)
            out *= through[:, None]
            out[:, rank] += shine
        return out

    def shader(self, filtered: bool = False) -> TermShader:
        """Make the shader by `texels.packed`."""
        levels, layout = self.levels if filtered and self.uses_uv else ([self.planes], self.layout)
        texels, sizes, places = packed(levels, self.planes.dtype == np.float16 and not filtered)
        wraps = dict(zip(("WRAP_U", "WRAP_V"), map(WRAPS.index, self.placement.wrap), strict=True))
        sizes |= wraps | {"PLANES": 4 * (texels.shape[1] // levels[0].shape[1]), "RANK": layout.rank, "TAPS": TAPS}
        names = {name.upper(): start for name, start in layout.starts.items()}
        sizes |= {f"AT_{name}": start for name, start in names.items()}
        for name, start in names.items():
            if name == "SPREAD":
                sizes |= {f"SPREAD_{axes}": layout.columns[start + k] for k, axes in enumerate(("XX", "XY", "YY"))}
            elif start < len(layout.columns):
                sizes[name] = layout.columns[start]
        # Compilers cut what is never read off the end of an array.
        read = [number for number, column in enumerate(layout.columns) if column < 0]
        constants = tuple(layout.constants[: max(read, default=0) + 1])
        uniforms = {"levels": places, "constants": constants, "cutoff": self.cutoff - ROUNDING}
        if filtered and self.uses_uv:
            uniforms["widened"] = WIDENED
        sizes |= {"CUT": 1} if self.cut else {}
        uniforms |= {"own_share": OWN_SHARE} if self.cut and filtered and self.uses_uv else {}
        if layout.coated:
            uniforms["coat_f0"] = COAT_F0
        uniforms |= {"placement": (*self.placement.scale, *self.placement.offset)}
        return TermShader(
            Path(__file__).with_name("maps.glsl"), {**sizes, "CONSTANTS": len(constants)}, {"planes": texels}, uniforms
        )

    @property
    def key(self) -> tuple:
        """Identity of the planes, and their use."""
        return "maps", id(self.planes), self.layout, self.cutoff, self.placement, self.cut

    @property
    def nbytes(self) -> int:
        """Bytes of planes and spectra."""
        return self.planes.nbytes + self.palette.values.nbytes

    @property
    def grid(self) -> str:
        """Texels across and down."""
        return f"{self.planes.shape[1]} x {self.planes.shape[0]} texels" if self.uses_uv else "alike everywhere"

    def stored(self) -> dict[str, Any]:
        """Return the stored fields: the planes (in their precision), their layout, and the palette."""
        kept: dict[str, Any] = {"planes": self.planes, "precision": self.precision, "palette": self.palette.stored()}
        kept |= {"columns": np.array(self.layout.columns), "constants": np.array(self.layout.constants)}
        kept |= {"scale": np.array(self.placement.scale), "offset": np.array(self.placement.offset)}
        return kept | {"wrap": " ".join(self.placement.wrap), "cutoff": self.cutoff, "rank": self.layout.rank}

    @classmethod
    def from_stored(cls, kept: Mapping[str, Any]) -> MapPlanes:
        """Return the summand whose `stored()` this is; KeyError if a field is missing."""
        numbers = {name: tuple(np.asarray(kept[name]).tolist()) for name in ("columns", "constants", "scale", "offset")}
        wrap, rank = cast("tuple[Wrap, Wrap]", tuple(str(kept["wrap"]).split())), int(kept["rank"])
        return cls(
            np.asarray(kept["planes"]),
            PlaneLayout(rank, numbers["columns"], numbers["constants"], len(numbers["columns"]) > 3 * rank + _UNCOATED),
            Palette.from_stored(kept["palette"]),
            float(kept["cutoff"]),
            Placement(numbers["scale"], numbers["offset"], wrap),
            kept["precision"],
        )
