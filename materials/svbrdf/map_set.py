"""Texture maps of one material, on one grid of texels, and the scattering of each texel."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar, cast

import numpy as np
from jaxtyping import Bool, Float, Int

from ...runtime.errors import InputError
from ...spectral.upsampling import upsampling
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM, interpolation_matrix
from ..core.surface import Cutout
from .facets import spread_of
from .texel_map import TexelMap
from .texels import REPEATED, WRAPS, Wrap, look_up

#: Least alpha: below, highlights are narrower than any picture shows; a perfect mirror has no BRDF at all.
LEAST_ALPHA = 0.002
#: Rounding of mixed opacity below a cutoff that it equals: single precision, of numbers from 0 to 1.
ROUNDING = 1e-6
#: F0 of glTF's dielectrics, whose refractive index is 1.5.
DIELECTRIC_F0 = 0.04
# Texels per block of derived numbers.
_TEXELS = 1 << 16
_ONE, _NONE = TexelMap.constant(1.0), TexelMap.constant(0.0)
AnyMaps = TypeVar("AnyMaps", bound="MapSet")


@dataclass(frozen=True)
class Placement:
    """Placement of a picture on its mesh's (u, v): scale x uv + offset, and the wrap mode beyond [0, 1]."""

    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)
    wrap: tuple[Wrap, Wrap] = REPEATED

    def of(self, uv: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 2"]:
        """(u, v) on the picture."""
        return uv * self.scale + self.offset


#: Placement by the mesh's own (u, v), repeated.
WHOLE = Placement()


@dataclass(frozen=True, eq=False)
class Texels:
    """Scattering of n texels.

    body, facets : (n,C) reflectance of body and facets at the normal: RGB, or C = L wavelengths.
    through : (n,) 1 - F of a dielectric at the normal, and `rest` at grazing: the fraction of light that reaches its
    body.
    edge : (n,) reflectance of facets at grazing. normal : (n,2) x and y of the unit normal.
    spread : (n,3) see `facets`. covers : (n,) opacity.
    coat : (n,) weight of the clear coat; None without any. coat_spread : (n,) alpha^2 of its facets. coat_normal :
    (n,2) as `normal`.
    """

    body: Float[np.ndarray, "n C"]
    facets: Float[np.ndarray, "n C"]
    through: Float[np.ndarray, " n"]
    rest: Float[np.ndarray, " n"]
    edge: Float[np.ndarray, " n"]
    normal: Float[np.ndarray, "n 2"]
    spread: Float[np.ndarray, "n 3"]
    covers: Float[np.ndarray, " n"]
    coat: Float[np.ndarray, " n"] | None = None
    coat_spread: Float[np.ndarray, " n"] | None = None
    coat_normal: Float[np.ndarray, "n 2"] | None = None


@dataclass(frozen=True, eq=False)
class MapSet:
    """Texture maps of a material; `maps.MappedSurface` defines their meaning.

    Parameters
    ----------
    wavelengths_nm : (L,) nm, ascending.
    base : red, green and blue, made into spectra by `uplift`; or, if that is "", L measured reflectances.
    metallic, weight : m and w. roughness : the square root of alpha, or two of them, along x and along y.
    reflected : c, red, green and blue, or one number.
    normal : x, y and z, of any length, z up; x along u and y along v. turn : radians that x of a stretched highlight is
        turned from u towards v. coverage : opacity; below `cutoff` there is a hole (`cutout`).
    coat, coat_roughness, coat_normal : of the clear coat, its weight w; the square root of its alpha; as `normal`, None
        for that of the mesh, without the bumps below.
    placement : of all maps.

    Raises
    ------
    InputError : maps of different sizes, or with another number of channels; a normal without length or below the
        surface, by its row and column.
    """

    wavelengths_nm: Float[np.ndarray, " L"]
    base: TexelMap
    roughness: TexelMap
    uplift: str
    metallic: TexelMap = _NONE
    reflected: TexelMap = field(default_factory=lambda: TexelMap.constant(DIELECTRIC_F0))
    weight: TexelMap = _ONE
    glossy: bool = False
    normal: TexelMap | None = None
    turn: TexelMap | None = None
    coverage: TexelMap = _ONE
    coat: TexelMap = _NONE
    coat_roughness: TexelMap = _NONE
    coat_normal: TexelMap | None = None
    cutoff: float = 0.0
    placement: Placement = WHOLE

    def __post_init__(self) -> None:
        colours = 3 if self.uplift else len(self.wavelengths_nm)
        channels = {"base": (colours,), "roughness": (1, 2), "metallic": (1,), "reflected": (1, 3), "weight": (1,)}
        channels |= {"normal": (3,), "turn": (1,), "coverage": (1,)}
        channels |= {"coat": (1,), "coat_roughness": (1,), "coat_normal": (3,)}
        for name, one in self.maps.items():
            if one.values.shape[2] not in channels[name]:
                expected = " or ".join(map(str, channels[name])) + " channels"
                raise InputError(
                    "not such a map", field=name, found=f"{one.values.shape[2]} channels", expected=expected
                )
        sizes = {name: one.size for name, one in self.maps.items() if one.size != (1, 1)}
        if len(set(sizes.values())) > 1:
            raise InputError("maps of different sizes", field="maps", found=sizes, expected="one size")
        for name, one in (("normal", self.normal), ("coat_normal", self.coat_normal)):
            if one is not None:
                check_normals(one, name)

    @property
    def maps(self) -> dict[str, TexelMap]:
        """All maps, by the name of their field."""
        names = ("base", "roughness", "metallic", "reflected", "weight", "normal", "turn", "coverage")
        names += ("coat", "coat_roughness", "coat_normal") if self.coated else ()
        return {name: one for name in names if (one := getattr(self, name)) is not None}

    @property
    def isotropic(self) -> bool:
        """True without bumps and with one roughness for all directions."""
        level = self.normal is None and (self.coat_normal is None or not self.coated)
        return level and self.roughness.values.shape[2] == 1

    @cached_property
    def coated(self) -> bool:
        """True if a clear coat lies on any texel."""
        return bool(self.coat.decoded(self.coat.values).any())

    @cached_property
    def size(self) -> tuple[int, int]:
        """(H, W) of the maps; (1, 1) if none varies."""
        return max(one.size for one in self.maps.values())

    def texels(self, rows: Int[np.ndarray, " n"], columns: Int[np.ndarray, " n"]) -> Texels:
        """Return the scattering of texels."""

        def number(one: TexelMap) -> np.ndarray:
            return one.at(rows, columns)[:, 0]

        base, reflected = self.base.at(rows, columns), np.minimum(self.reflected.at(rows, columns), 1.0)
        weight, most = number(self.weight), reflected.max(axis=1)
        if self.glossy:
            metal = np.zeros(len(rows))
            body, shine, edge = base * (1.0 - most)[:, None], reflected * np.ones(3), np.ones(len(rows))
            weight = np.ones(len(rows))
        else:
            metal = number(self.metallic)
            body = base * (1.0 - metal)[:, None]
            shine = self._coloured(reflected) * ((1.0 - metal) * weight)[:, None] + base * metal[:, None]
            edge = (1.0 - metal) * weight + metal
        alpha = np.maximum(self.roughness.at(rows, columns) ** 2, LEAST_ALPHA) * np.ones(2)
        turn = None if self.turn is None else number(self.turn)

        def lean(normal: TexelMap | None) -> np.ndarray:
            if normal is None:
                return np.zeros((len(rows), 2))
            vector = normal.at(rows, columns)
            return vector[:, :2] / np.linalg.norm(vector, axis=1, keepdims=True)

        through, rest, spread = 1.0 - weight * most, 1.0 - weight, spread_of(alpha, turn)
        coat = None, None, None
        if self.coated:
            smooth = np.maximum(number(self.coat_roughness) ** 2, LEAST_ALPHA) ** 2
            coat = number(self.coat), smooth, lean(self.coat_normal)
        return Texels(body, shine, through, rest, edge, lean(self.normal), spread, number(self.coverage), *coat)

    def _coloured(self, reflected: np.ndarray) -> np.ndarray:
        """Convert the reflectance of facets to as many numbers as `base` has."""
        if self.uplift or reflected.shape[1] == 1:
            return reflected * np.ones(self.base.values.shape[2])
        # Beside measured colours, one that was stated in RGB has to be made up.
        return spectra_of(reflected, "mallett-yuksel", self.wavelengths_nm)

    def spectra(self, colours: Float[np.ndarray, "n C"]) -> Float[np.ndarray, "n L"]:
        """Return the reflectance spectra of `Texels.body` or `Texels.facets`."""
        return spectra_of(colours, self.uplift, self.wavelengths_nm) if self.uplift else colours

    def blocks(self) -> Iterator[tuple[slice, Texels]]:
        """Yield all texels in row-major blocks: the slice of their indices, and their scattering."""
        height, width = self.size
        for start in range(0, height * width, _TEXELS):
            numbers = np.arange(start, min(start + _TEXELS, height * width))
            yield slice(start, start + len(numbers)), self.texels(*np.divmod(numbers, width))

    def parameters(self) -> dict[str, Any]:
        """Return the parameters that rebuild these maps."""
        kept: dict[str, Any] = {"wavelengths_nm": self.wavelengths_nm, "uplift": self.uplift or "none"}
        kept |= {"glossy": int(self.glossy), "cutoff": self.cutoff}
        kept |= {"scale": np.array(self.placement.scale), "offset": np.array(self.placement.offset)}
        kept |= {"wrap": " ".join(self.placement.wrap)}
        for name, one in self.maps.items():
            kept |= one.parameters(name)
        return kept

    @classmethod
    def from_parameters(cls: type[AnyMaps], parameters: Mapping[str, Any]) -> AnyMaps:
        """Return the maps whose `parameters()` these are.

        Raises
        ------
        InputError : a parameter is missing or not what it should be.
        """
        try:
            names = {name.partition(".")[0] for name in parameters if name.endswith(".values")}
            maps: dict[str, Any] = {name: TexelMap.from_parameters(parameters, name) for name in names}
            words = str(parameters["wrap"]).split()
            if len(words) != 2 or not set(words) <= set(WRAPS):
                raise InputError("unknown word", field="wrap", found=parameters["wrap"], expected=", ".join(WRAPS))
            scale, offset = (tuple(np.asarray(parameters[name], float).tolist()) for name in ("scale", "offset"))
            uplift = str(parameters["uplift"])
            return cls(
                wavelengths_nm=np.asarray(parameters["wavelengths_nm"], dtype=np.float64),
                uplift="" if uplift == "none" else uplift,
                glossy=bool(int(parameters["glossy"])),
                cutoff=float(parameters["cutoff"]),
                placement=Placement(scale, offset, cast("tuple[Wrap, Wrap]", tuple(words))),
                **maps,
            )
        except (KeyError, TypeError) as reason:
            raise InputError("missing parameter of maps", field=str(reason)) from None


def check_normals(normal: TexelMap, name: str = "normal") -> None:
    """Raise `InputError` for a normal without length or one that points below the surface, by its row and column."""
    height, width = normal.size
    step = max(1, _TEXELS // width)
    for start in range(0, height, step):
        vectors = normal.decoded(normal.values[start : start + step])
        length = np.linalg.norm(vectors, axis=-1)
        # Integers have no 0: half of their codes lies between two of them.
        short, below = length < 0.02, vectors[..., 2] <= 0.0
        if (short | below).any():
            row, column = (int(at) for at in np.argwhere(short | below)[0])
            found = ", ".join(f"{value:.3g}" for value in vectors[row, column])
            raise InputError(
                "a normal without length" if short[row, column] else "a normal that points below the surface",
                field=f"{name}, row {start + row}, column {column}",
                found=f"({found}), and {int((short | below).sum()) - 1} more in {vectors.size // 3} texels about it",
                expected="x, y and z of a vector that points up",
                hint="export the normal map again, or mend those texels",
            )


def spectra_of(
    rgb: Float[np.ndarray, "n 3"], method: str, wavelengths_nm: Float[np.ndarray, " L"]
) -> Float[np.ndarray, "n L"]:
    """Upsample linear colours to reflectances, at working or other wavelengths; see `Upsampling.spectra`.

    Where a method would exceed 1, enough of Mallett and Yuksel's bounded spectrum of the same colour is mixed in; the
    colour stays.
    """
    made = upsampling(method).spectra(rgb)
    high = made > 1.0
    some = np.flatnonzero(high.any(axis=1)) if method != "mallett-yuksel" else ()
    if len(some):
        bounded = np.minimum(upsampling("mallett-yuksel").spectra(rgb[some]), 1.0)
        over = np.where(high[some], made[some] - 1.0, 0.0)
        apart = np.where(high[some], made[some] - bounded, 1.0)
        share = (over / apart).max(axis=1, keepdims=True)
        made[some] = np.minimum((1.0 - share) * made[some] + share * bounded, 1.0)
    if np.array_equal(wavelengths_nm, WORKING_WAVELENGTHS_NM):
        return made
    return made @ interpolation_matrix(WORKING_WAVELENGTHS_NM, wavelengths_nm).T


@dataclass(frozen=True, eq=False)
class Mask(Cutout):
    """Holes where the opacity of a mask is below its cutoff (glTF's alphaMode MASK).

    opacity : (H,W,1) in [0, 1], linear between texels. cutoff : smallest opacity that is not a hole.
    placement : of the mask on the mesh.
    """

    opacity: Float[np.ndarray, "H W 1"]
    cutoff: float
    placement: Placement

    def holes(self, uv: Float[np.ndarray, "N 2"]) -> Bool[np.ndarray, " N"]:
        """Implement `Cutout.holes`."""
        found = look_up(self.opacity, self.placement.of(uv), self.placement.wrap)[:, 0]
        return found < self.cutoff - ROUNDING
