"""Mean surface of a textured one: the mean of its maps in linear light, texel by texel.

The reflection of each texel is computed before averaging, so that rust on steel does not become half a metal.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from ....runtime.errors import InputError
from ....spectral.upsampling import upsampling
from ....spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ...svbrdf.textures import Texture, blocks

#: F0 of glTF's dielectrics, whose refractive index is 1.5.
DIELECTRIC_F0 = 0.04
#: Least alpha: below, highlights are narrower than a fit can follow; a perfect mirror has no BRDF at all.
LEAST_ALPHA = 0.002
_KEPT_MEANS = 256
_means: OrderedDict[tuple, SurfaceMeans] = OrderedDict()


@dataclass(frozen=True)
class Colour:
    """`scale` times the linear colour of a texture; `scale` alone without one."""

    texture: Texture | None = None
    scale: tuple[float, ...] = (1.0, 1.0, 1.0)

    def at(self, rows: slice, size: tuple[int, int]) -> Float[np.ndarray, "*texels 3"]:
        """Return the colour at rows of texels."""
        scale = np.asarray(self.scale)
        return scale if self.texture is None else scale * self.texture.linear(rows, size)


@dataclass(frozen=True)
class Number:
    """`scale` times one channel of a texture, or 1 minus that; `scale` alone without one."""

    texture: Texture | None = None
    channel: int = 0
    scale: float = 1.0
    inverted: bool = False

    def at(self, rows: slice, size: tuple[int, int]) -> Float[np.ndarray, "*texels 1"]:
        """Return the number at rows of texels."""
        value = np.array([self.scale])
        if self.texture is not None:
            value = value * self.texture.band(self.channel, rows, size)[..., None]
        return 1.0 - value if self.inverted else value


@dataclass(frozen=True)
class SurfaceMaps:
    """Properties of each texel in glTF (appendix B.3.5; extensions specular, clearcoat and specular-glossiness).

    reflected : reflectance of a dielectric's facets at the normal, multiplied by `weight`.
    glossy : True where `base` is the body's colour and `reflected` that of all facets, metals too.
    coverage : alpha, the weight of a texel; with `cutoff`, 0 or 1.
    """

    base: Colour = Colour()
    metallic: Number = Number(scale=0.0)
    roughness: Number = Number()
    reflected: Colour = Colour(scale=(DIELECTRIC_F0,) * 3)
    weight: Number = Number()
    glossy: bool = False
    coverage: Number = Number()
    cutoff: float | None = None
    coat: Number = Number(scale=0.0)
    coat_roughness: Number = Number(scale=0.0)

    @property
    def textures(self) -> tuple[Texture, ...]:
        """Every texture that is used, each once."""
        parts = (getattr(self, field.name) for field in fields(self))
        found = (part.texture for part in parts if isinstance(part, Colour | Number))
        return tuple(dict.fromkeys(texture for texture in found if texture is not None))

    def mean(self) -> SurfaceMeans:
        """Means over all texels; raises `InputError` where a texture cannot be decoded."""
        key = self._key
        if key not in _means:
            _means[key] = self._mean()
            while len(_means) > _KEPT_MEANS:
                _means.popitem(last=False)
        return _means[key]

    @property
    def _key(self) -> tuple:
        numbers = []
        for field in fields(self):
            part = getattr(self, field.name)
            if isinstance(part, Colour | Number):
                picture = part.texture and (part.texture.digest, part.texture.encoding)
                part = (picture, part.scale, getattr(part, "channel", 0), getattr(part, "inverted", False))
            numbers.append(part)
        return tuple(numbers)

    def _mean(self) -> SurfaceMeans:
        sizes = [texture.size for texture in self.textures]
        size = max(sizes, key=lambda size: size[0] * size[1], default=(1, 1))
        for covered in (True, False):
            total, weight = np.zeros(10), 0.0
            for rows in blocks(*size):
                texels = (rows.stop - rows.start) * size[1]
                parts, share = self._texels(rows, size, covered)
                total += np.concatenate([_weighted_sum(part, share, texels) for part in parts])
                weight += float(_weighted_sum(np.ones(1), share, texels)[0])
            if weight > 0:
                break
        mean = total / weight
        return SurfaceMeans(
            diffuse=tuple(mean[0:3]),
            specular=tuple(mean[3:6]),
            edge=min(float(mean[6]), 1.0),
            roughness=float(mean[7]),
            coat=min(float(mean[8]), 1.0),
            coat_roughness=float(mean[9]),
            opacity=weight / (size[0] * size[1]) if covered else 0.0,
            sizes=tuple(dict.fromkeys(sizes)),
        )

    def _texels(self, rows: slice, size: tuple[int, int], covered: bool) -> tuple[list[np.ndarray], np.ndarray]:
        """Return diffuse, specular, edge, roughness, coat and its roughness, and the weight of each texel.

        Each is (h, W, 3) or (h, W, 1), or (3,) or (1,) if it is constant.
        """
        base, reflected = self.base.at(rows, size), self.reflected.at(rows, size)
        if self.glossy:
            diffuse, specular, edge = base * (1.0 - reflected.max(axis=-1, keepdims=True)), reflected, np.ones(1)
        else:
            metallic, weight = self.metallic.at(rows, size), self.weight.at(rows, size)
            diffuse = base * (1.0 - metallic)
            specular = (1.0 - metallic) * weight * np.minimum(reflected, 1.0) + metallic * base
            edge = (1.0 - metallic) * weight + metallic
        rest = (edge, self.roughness.at(rows, size), self.coat.at(rows, size), self.coat_roughness.at(rows, size))
        share = self.coverage.at(rows, size) if covered else np.ones(1)
        if self.cutoff is not None and covered:
            share = (share >= self.cutoff).astype(np.float64)
        return [diffuse, specular, *rest], share


def _weighted_sum(part: np.ndarray, share: np.ndarray, texels: int) -> np.ndarray:
    """Sum `part` times `share` over texels; either may be constant."""
    if part.ndim == 1:
        return part * (share.sum() if share.ndim > 1 else share[0] * texels)
    return part.sum(axis=(0, 1)) * share[0] if share.ndim == 1 else np.einsum("hwc,hw->c", part, share[..., 0])


@dataclass(frozen=True)
class SurfaceMeans:
    """Means of `SurfaceMaps`: linear red, green and blue, and numbers in [0, 1].

    opacity : the mean of coverage; 0 if all weights are 0, and the means are then over all texels.
    sizes : (H, W) of the textures.
    """

    diffuse: tuple[float, ...]
    specular: tuple[float, ...]
    edge: float
    roughness: float
    coat: float
    coat_roughness: float
    opacity: float
    sizes: tuple[tuple[int, int], ...]


def model_of(maps: SurfaceMaps, uplift: str) -> tuple[dict[str, object], list[str]]:
    """Return parameters of the model "metallic_roughness", and the assumptions, in words."""
    mean = maps.mean()
    notes = []
    diffuse, note = reflectance_of(mean.diffuse, uplift)
    specular, other = reflectance_of(mean.specular, uplift)
    notes += [text for text in (note, other) if text]
    alphas = []
    for name, roughness, counts in (
        ("roughness", mean.roughness, True),
        ("clearcoat roughness", mean.coat_roughness, mean.coat > 0),
    ):
        alphas.append(max(roughness**2, LEAST_ALPHA))
        if counts and roughness**2 < LEAST_ALPHA:
            notes.append(f"{name} {roughness:.3g} is taken as {LEAST_ALPHA**0.5:.3g}: a mirror has no BRDF")
    if maps.textures:
        notes.append("what is rendered is the mean of the maps in linear light; the maps are kept")
    if len(mean.sizes) > 1:
        shown = ", ".join(f"{width} x {height}" for height, width in mean.sizes)
        notes.append(f"maps of different sizes ({shown}) were laid over each other")
    if mean.opacity < 1.0 - 1e-9:
        how = (
            "no texel is opaque: the mean is of all" if mean.opacity == 0 else f"opacity {mean.opacity:.3g} on average"
        )
        notes.append(f"{how}; it is rendered opaque")
    parameters: dict[str, object] = {
        "wavelengths_nm": WORKING_WAVELENGTHS_NM,
        "diffuse": diffuse,
        "specular": specular,
        "edge": mean.edge,
        "alpha": alphas[0],
        "coat": mean.coat,
        "coat_alpha": alphas[1] if mean.coat > 0 else 1.0,
    }
    return parameters, notes


def reflectance_of(rgb: tuple[float, ...], uplift: str) -> tuple[Float[np.ndarray, " L"], str]:
    """Upsample a linear colour in [0, 1] to a reflectance; with a note if the method alone would exceed 1.

    Then enough of Mallett and Yuksel's bounded spectrum of the same colour is mixed in; the colour stays.
    """
    colour = np.asarray(rgb, dtype=np.float64)
    if colour.min() < -1e-9 or colour.max() > 1.0 + 1e-9:
        found, hint = np.round(colour, 4).tolist(), "scale the colours, or leave out what shines by itself"
        raise InputError(
            "no reflectance has this colour", field="colour", found=found, expected="from 0 to 1", hint=hint
        )
    colour = np.clip(colour, 0.0, 1.0)
    made = upsampling(uplift).spectra(colour)
    bounded = np.minimum(upsampling("mallett-yuksel").spectra(colour), 1.0)  # white: 1.00000001, the table's rounding
    high = made > 1.0
    if not high.any():
        return made, ""
    share = float(((made - 1.0)[high] / (made - bounded)[high]).max()) if uplift != "mallett-yuksel" else 1.0
    note = f"spectra by {uplift} exceed 1: {100 * share:.0f} % of mallett-yuksel's are mixed in, which keeps the colour"
    mixed = np.minimum((1.0 - share) * made + share * bounded, 1.0)
    return mixed, "" if uplift == "mallett-yuksel" else note
