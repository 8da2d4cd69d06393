"""Pictures at sites from transfer tensors, while light, view and all materials change (Sun et al. 2007, section 3.3).

Where the paper carries red, green and blue, sums here are scalar, one for each sequence of regions that light takes and
of the two spectra that each has, its matt one and its highlight's: the spectra of a sequence are multiplied wavelength
by wavelength and folded once with light and observer, so that colour is exact whatever the light.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from ....lighting.environment.cube import CubeMap
from ....lighting.environment.environment import EnvironmentLight
from ....lighting.environment.pyramid import Pyramid
from ..harmonics import gaussian_factors, harmonics
from .brdf_tensor import BrdfTensor
from .clustered import ClusteredTensor, clustered_tensor
from .components import Components
from .direct import DirectTensor, direct_tensor
from .families import Family
from .parametric import Tuned
from .precomputed import BANDS, ONE_BOUNCE, TWO_BOUNCES, TransferTensors, local, unpack_visibility

# Texels of a cube map, each way, that factors of the light are projected onto harmonics over.
_FACTORS = 16
# Sites at once, where each looks at all of its visibility.
_AT_ONCE = 128


@dataclass(frozen=True, eq=False)
class Arriving:
    """Light arriving at S sites of K fields of a light, scalar, before any material is known.

    direct (S,1+k,K) : with the factors. prefiltered : the light itself, under Gaussians.
    one (S,R,P,K,B), two (S,R,P,R,P,K).
    """

    direct: Float[np.ndarray, "S k1 K"]
    prefiltered: Pyramid
    one: Float[np.ndarray, "S R P K B"]
    two: Float[np.ndarray, "S R P R P K"]


@dataclass(frozen=True, eq=False)
class TensorTransfer:
    """All that relighting needs of a scene and of a family."""

    tensors: TransferTensors
    family: Family
    brdf: BrdfTensor
    components: Components
    direct: DirectTensor
    one: ClusteredTensor
    two: ClusteredTensor

    @classmethod
    def of(
        cls,
        tensors: TransferTensors,
        family: Family,
        brdf: BrdfTensor,
        components: Components,
        clusters: int | None = None,
    ) -> TensorTransfer:
        """Tensors, compressed as the paper compresses them."""
        sites, regions, parts, _, _, lights = tensors.two.shape
        # The light of two bounces is coarse already: it is kept whole, and only sites are compressed.
        two = np.moveaxis(tensors.two.reshape(sites, regions * parts, regions, parts, lights), 1, 4)
        return cls(
            tensors,
            family,
            brdf,
            components,
            direct_tensor(tensors, brdf),
            clustered_tensor(tensors.one, clusters),
            clustered_tensor(two, clusters, lights=lights),
        )

    @property
    def nbytes(self) -> int:
        """Bytes that relighting keeps of the geometry: T0 as it is, and all that is compressed."""
        return self.tensors.visible.nbytes + self.direct.nbytes + self.one.nbytes + self.two.nbytes

    def arriving(self, light: EnvironmentLight) -> Arriving:
        """Return the work that another light costs."""
        sites, regions, parts, _, _, _ = self.tensors.two.shape
        two = self.two.lit(CubeMap(TWO_BOUNCES).means(light))
        two = np.moveaxis(two, 4, 1).reshape(sites, regions, parts, regions, parts, -1)
        return Arriving(
            self.direct.lit(CubeMap(self.tensors.across).means(light)),
            Pyramid.of(light),
            self.one.lit(CubeMap(ONE_BOUNCE).means(light)),
            two,
        )

    def xyz(
        self,
        arriving: Arriving,
        materials: Sequence[Tuned],
        eye: Float[np.ndarray, "3"],
        weights: Sequence[Float[np.ndarray, "3 L"]],
        reference_lux: float,
        bounces: int = 2,
    ) -> Float[np.ndarray, "S 3"]:
        """Compute the XYZ that a viewer at `eye` (in the coordinates of the sites) sees of each site; 0 where it looks
        away.

        materials : of each region. weights : of each field of the light, from spectra to XYZ, Y = 1 of the perfect
        diffuser (`Observer.weights`). reference_lux : what makes Y of a perfect diffuser 1. bounces : 0, 1 or 2.
        """
        sites = self.tensors
        to = eye - sites.sites
        to /= np.linalg.norm(to, axis=1, keepdims=True)
        wo = local(to, sites.normals)
        mixtures = [one.weights for one in materials]
        chosen = np.stack([np.concatenate([[0.0], one @ self.components.by_member]) for one in mixtures])
        # (R, 2, P): what the matt spectrum and the highlight's take of each component.
        split = np.zeros((len(materials), 2, chosen.shape[1]))
        split[:, 0, 0], split[:, 1] = 1.0, chosen
        spectra = np.stack([np.stack([one.diffuse, one.specular]) for one in materials])
        found = np.zeros((len(to), 3))
        for region, mixture in enumerate(mixtures):
            mine = np.flatnonzero((sites.region == region) & (wo[:, 2] > 0.0))
            if not len(mine):
                continue
            seen = _Seen(self, mixture, mine, wo[mine])
            for field, weigh in enumerate(weights):
                own = spectra[region] @ (weigh.T * (np.pi / reference_lux))[None]
                found[mine] += np.einsum("na,ac->nc", seen.direct(arriving, field), own[0])
                by = spectra[region][:, None, None] * spectra[None]
                if bounces > 0:
                    one = np.einsum("nrps,rbp->nrbs", arriving.one[mine, :, :, field], split, optimize=True)
                    folded = by @ weigh.T * (np.pi / reference_lux)
                    found[mine] += np.einsum("narb,arbc->nc", seen.once(one), folded, optimize=True)
                if bounces > 1:
                    two = np.einsum("nrpqs,rbp,qds->nrbqd", arriving.two[mine, ..., field], split, split, optimize=True)
                    thrice = by[:, :, :, None, None] * spectra[None, None, None]
                    folded = thrice @ weigh.T * (np.pi / reference_lux)
                    evenly = seen.evenly
                    found[mine] += np.einsum("na,nrbqd,arbqdc->nc", evenly, two, folded, optimize=True)
        return found

    @cached_property
    def of_light(self) -> Float[np.ndarray, "S B k"]:
        """C(s, k) of each site: harmonics of the world times factors of the light, above its horizon."""
        cube = CubeMap(_FACTORS)
        world = harmonics(cube.directions, BANDS) * cube.solid_angles[:, None]
        found = np.empty((len(self.tensors.sites), BANDS**2, self.brdf.by_light.shape[1]), dtype=np.float32)
        for site, normal in enumerate(self.tensors.normals):
            above = np.flatnonzero(cube.directions @ normal > 0.0)
            to = local(cube.directions[above], np.broadcast_to(normal, (len(above), 3)))
            found[site] = world[above].T @ self.brdf.disc.look_up(self.brdf.by_light, to)
        return found

    @cached_property
    def evenly_lit(self) -> Float[np.ndarray, " k"]:
        """C(k): of even light, cosine and all."""
        cube = CubeMap(4 * _FACTORS)
        to, angle = cube.directions, cube.solid_angles
        above = to[:, 2] > 0.0
        return (to[above, 2] * angle[above]) @ self.brdf.disc.look_up(self.brdf.by_light, to[above])


class _Seen:
    """Light that some sites of one region send to the viewer: of the matt part, and of the highlight."""

    def __init__(
        self,
        transfer: TensorTransfer,
        mixture: Float[np.ndarray, " N"],
        mine: np.ndarray,
        wo: Float[np.ndarray, "n 3"],
    ) -> None:
        self._transfer, self._mine, self._wo = transfer, mine, wo
        self._factors = transfer.brdf.view_weights(mixture, wo)
        highlights = transfer.brdf.highlights
        self._sharpness = highlights.sharpness
        # A Gaussian's peak to its integral.
        self._lobes = highlights.amplitudes_at(mixture, wo[:, 2]) * (2.0 * np.pi / self._sharpness)

    @cached_property
    def _mirrored(self) -> Float[np.ndarray, "n 3"]:
        from .precomputed import outward

        return outward(self._wo * (-1.0, -1.0, 1.0), self._transfer.tensors.normals[self._mine])

    @cached_property
    def _free(self) -> Float[np.ndarray, "n 4"]:
        """The share of each Gaussian that nothing hides, by the site's map of visibility."""
        tensors = self._transfer.tensors
        cube = CubeMap(tensors.across)
        # A Gaussian narrower than a texel is as free as that is: three deviations cover one.
        widest = (6.0 * tensors.across / np.pi) ** 2
        found = np.empty((len(self._mine), len(self._sharpness)))
        for start in range(0, len(self._mine), _AT_ONCE):
            rows = slice(start, start + _AT_ONCE)
            away = self._mirrored[rows].astype(np.float32) @ cube.directions.T.astype(np.float32) - 1.0
            seen = unpack_visibility(tensors.visible[self._mine[rows]], tensors.across)
            for lobe, sharpness in enumerate(np.minimum(self._sharpness, widest)):
                bump = np.exp(np.float32(sharpness) * away) * cube.solid_angles.astype(np.float32)
                found[rows, lobe] = (bump * seen).sum(axis=1) / bump.sum(axis=1)
        return found

    def direct(self, arriving: Arriving, field: int) -> Float[np.ndarray, "n 2"]:
        """Reflect direct light: cd/m^2 of spectra of 1."""
        factors = arriving.direct[self._mine, :, field]
        towards = np.repeat(self._mirrored, len(self._sharpness), axis=0)
        mean = arriving.prefiltered(towards, np.tile(self._sharpness, len(self._mirrored)))[:, field]
        mean = mean.reshape(-1, len(self._sharpness))
        lobes = np.sum(self._lobes * mean * self._free, axis=1) * self._wo[:, 2]
        return np.stack([factors[:, 0] / np.pi, np.sum(self._factors * factors[:, 1:], axis=1) + lobes], axis=1)

    def once(self, one: Float[np.ndarray, "n R b B"]) -> Float[np.ndarray, "n 2 R b"]:
        """Reflect light by way of each region's two spectra."""
        transfer = self._transfer
        matt = one[..., 0] * (np.sqrt(4.0 * np.pi) / np.pi)
        smooth = np.einsum("nk,nsk->ns", self._factors, transfer.of_light[self._mine], optimize=True)
        about = harmonics(self._mirrored, BANDS)
        smooth += np.einsum("nl,ls->ns", self._lobes, gaussian_factors(self._sharpness, BANDS)) * about
        return np.stack([matt, np.einsum("nrbs,ns->nrb", one, smooth, optimize=True)], axis=1)

    @cached_property
    def evenly(self) -> Float[np.ndarray, "n 2"]:
        """Reflect even light of 1 cd/m^2; the highlights' share of it is disregarded."""
        smooth = self._factors @ self._transfer.evenly_lit
        return np.stack([np.ones(len(smooth)), smooth], axis=1)
