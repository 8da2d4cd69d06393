"""Area, environment and indirect light gathered at samples, in numpy; twin of `gather.frag`."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from ...lighting.environment.bright_light import BrightLight
from ...lighting.environment.panel import GatheredPanel
from ...lighting.environment.prefiltering import GatheredLight, rotate_moments
from ...lighting.transfer.indirect import IndirectLight, light_at, radiance_under_lobes
from ...lighting.visibility.compression import straight
from ...lighting.visibility.cut_lobe import cut_lobe
from ...lighting.visibility.free_share import free_share, share_above
from ...materials.core.environment_form import Lobes, bends
from ...materials.core.points import Points
from ...materials.core.terms import Terms
from ..render.layers import SpreadLayer
from ..render.light_cache import Shadows

# Samples per block: their lobes and gathered light take some 30 MB.
_BLOCK = 1 << 13
_Gathered = tuple[Float[np.ndarray, "N B K"], Float[np.ndarray, "N Q K"]]


@dataclass(frozen=True, eq=False)
class TileSamples:
    """N samples of one part, independent of a light's direction.

    pixel (N,) : in a tile. points : for evaluating materials, without a light direction. frame (N, 3, 3) : rows
    tangent, bitangent and normal, world. face (N,) : triangle of the scene; weights (N, 3) : barycentric.
    back (N,) : True where the triangle's normal faces away from the viewer. facet (N, 3) : unit normal of the triangle,
    world, on the viewer's side. position (N, 3) : in radii about the scene's centre, for lights at a finite distance.
    """

    pixel: Int[np.ndarray, " N"]
    points: Points
    frame: Float[np.ndarray, "N 3 3"]
    face: Int[np.ndarray, " N"]
    weights: Float[np.ndarray, "N 3"]
    back: Bool[np.ndarray, " N"]
    facet: Float[np.ndarray, "N 3"]
    position: Float[np.ndarray, "N 3"] | None = None

    def chosen(self, which: Int[np.ndarray, " K"] | slice) -> TileSamples:
        """Select samples by index."""
        arrays = (self.frame[which], self.face[which], self.weights[which], self.back[which], self.facet[which])
        position = None if self.position is None else self.position[which]
        return TileSamples(self.pixel[which], self.points.chosen(which), *arrays, position)


def gathered_terms(layer: SpreadLayer, samples: TileSamples) -> Terms:
    """Compute the terms of a layer at N samples: for each of its fields those of the form, padded to a multiple of
    four.

    XYZ = pi / E_ref times the sum over lobes of the integral of f_r cos(theta_i) times the mean luminance under the
    lobe (Wang et al. 2009, eq. 41); for the cosine lobe its integral times E / pi.
    """
    width = layer.rank // (layer.fields.stop - layer.fields.start)
    value = np.zeros((len(samples.pixel), layer.fields.stop - layer.fields.start, width))
    for start in range(0, len(value), _BLOCK):
        rows = slice(start, start + _BLOCK)
        some = samples.chosen(rows)
        lobes, smooth = layer.form.lobes(some.points), some.frame[:, 2]
        if lobes.frame is not None:
            some = replace(some, frame=lobes.frame @ some.frame)
        rank = lobes.matt.shape[2]
        if isinstance(layer.gathered, IndirectLight):
            lux, seen = _of_surfaces(layer.gathered, layer.fields, some, lobes, smooth)
        elif isinstance(layer.gathered, GatheredPanel):
            lux, seen = _of_panel(layer, some, lobes)
        else:
            lux, seen = _of_environment(layer, some, lobes)
        found = np.einsum("nbk,nbr->nkr", lux / np.pi, lobes.matt)
        found += np.einsum("nqk,nqr->nkr", seen, lobes.value)
        value[rows, :, :rank] = found
    return Terms(layer.scale * value.reshape(len(value), -1))


def _of_surfaces(
    light: IndirectLight, fields: slice, samples: TileSamples, lobes: Lobes, smooth: Float[np.ndarray, "N 3"]
) -> _Gathered:
    """Gather indirect light: moments of illuminance, and mean luminance under each lobe. `smooth` : normals without
    normal mapping.
    """
    sites, shares = light.near(samples.face, samples.weights, samples.back)
    at = np.einsum("nc,ncvf->nvf", shares, light.at_sites[..., fields][sites])
    moments, radiance = light_at(at, smooth, samples.frame[:, 2])
    lux = rotate_moments(moments, samples.frame)[:, : lobes.matt.shape[1]]
    to_world = np.einsum("nqi,nij->nqj", lobes.directions, samples.frame)
    seen = radiance_under_lobes(radiance, to_world, lobes.sharpness)
    if light.maps is not None and lobes.sharpness.shape[1]:
        seen = light.maps.under_lobes(seen, sites, shares, to_world, lobes.sharpness, fields)
    return lux, seen


def _of_environment(layer: SpreadLayer, samples: TileSamples, lobes: Lobes) -> _Gathered:
    """Gather an environment: moments of illuminance, and mean luminance under each lobe, by the layer's fields."""
    assert isinstance(layer.gathered, GatheredLight)
    # From the local frame via the world to the map.
    to_map = np.einsum("nij,jk->nik", samples.frame, layer.world_from_map)
    lux = layer.gathered.by_frames(to_map, lobes.matt.shape[1])[..., layer.fields]
    directions = np.einsum("nqi,nij->nqj", lobes.directions, to_map)
    seen = layer.gathered.by_lobes(directions, lobes.sharpness)[..., layer.fields]
    shadows = layer.shadows
    if shadows is None or shadows.bright is None:
        return lux, seen
    return _left(layer, shadows, shadows.bright, samples, lobes, lux, seen)


def _of_panel(layer: SpreadLayer, samples: TileSamples, lobes: Lobes) -> _Gathered:
    """Gather a softbox, with occlusion by cells.

    The light of hidden cells is subtracted from illuminance and moments. A lobe's luminance is multiplied by the free
    share of cells, weighted by the lobe; the angle to the nearest boundary between both axes is interpolated as in
    `_left`.
    """
    panel, position = layer.gathered, samples.position
    assert isinstance(panel, GatheredPanel) and position is not None
    frame = samples.frame
    lux = panel.by_frames(position, frame, lobes.matt.shape[1])
    to_world = np.einsum("nqi,nij->nqj", lobes.directions, frame)
    seen = panel.by_lobes(position, to_world, lobes.sharpness)
    if layer.shadows is None:
        return lux[..., None], seen[..., None]
    visibility, count = layer.shadows.visibility, lobes.sharpness.shape[1]
    vertices, weights = visibility.located(samples.face, samples.weights)
    cells, angles, sharpness = panel.seen_cells(position)
    directions = np.concatenate([to_world, cells], axis=1)
    distance = visibility.signed_distances(vertices, weights, directions, samples.back)
    own, other = distance[:, :count], distance[:, count:]

    above = share_above(
        np.einsum("npi,ni->np", cells, samples.facet), np.einsum("npi,ni->np", cells, frame[:, 2]), sharpness
    )
    hidden = 1.0 - np.minimum(free_share(other, sharpness), above)
    local = np.einsum("nij,npj->npi", frame, cells)
    given = angles * np.maximum(local[..., 2], 0.0)
    whole = given.sum(axis=1)
    lost = np.einsum("np,npb->nb", hidden * given, bends(local)[..., : lux.shape[1]])
    left = lux - lost * (lux[:, 0] / np.where(whole > 0.0, whole, 1.0))[:, None]
    # A panel just above the horizon may have all cell centres below it.
    lux = np.where((whole > 0.0)[:, None], left, lux * (1.0 - hidden.mean(axis=1))[:, None])

    other_sharpness, own_sharpness = sharpness[:, None], lobes.sharpness[..., None]
    both = own_sharpness + other_sharpness
    narrower = own_sharpness * other_sharpness / both
    off = narrower * (1.0 - np.einsum("nqi,npi->nqp", to_world, cells))
    under = angles[:, None] * narrower * np.exp(off.min(axis=2, keepdims=True) - off)
    share = other_sharpness / both
    free = free_share(share * other[:, None] + (1.0 - share) * own[..., None], both)
    total = under.sum(axis=2)
    seen = seen * np.where(total > 0.0, (under * free).sum(axis=2) / np.where(total > 0.0, total, 1.0), 1.0)
    return lux[..., None], seen[..., None]


def _left(
    layer: SpreadLayer,
    shadows: Shadows,
    bright: BrightLight,
    samples: TileSamples,
    lobes: Lobes,
    lux: Float[np.ndarray, "N B K"],
    seen: Float[np.ndarray, "N Q K"],
) -> _Gathered:
    """Apply occlusion by the scene to the gathered `lux` and `seen`.

    For lobes: each bright part is multiplied by the free share about the axis of its product with the lobe (Wang et al.
    2009, eq. 5), with the angle to the nearest boundary interpolated linearly between both axes; the rest is gathered
    over the free part of the lobe (`cut_lobe`). For illuminance: each narrow bright part is multiplied by the free
    share about its axis; of all other light the relative loss at the surrounding vertices is subtracted, since pixels
    may have other normals. Occlusion of bright parts by the triangle's own plane is subtracted too (`share_above`).
    """
    assert isinstance(layer.gathered, GatheredLight)
    visibility, frame = shadows.visibility, samples.frame
    hidden, narrow, count = shadows.hidden, bright.narrow, lobes.sharpness.shape[1]
    vertices, weights = visibility.located(samples.face, samples.weights)
    axis, sharpness, amplitude = bright.parts.axis, bright.parts.sharpness, bright.parts.amplitude[:, layer.fields]
    codes, dark = visibility.mixed(vertices, weights, samples.back)
    bent_distances = codes @ hidden.axes.T + hidden.mean
    other = straight(np.where(dark[:, None] > 0.0, -1.0, bent_distances))

    # Each part's irradiance, moments, and free share, limited by the higher of two horizons.
    given = bright.on_surfaces(frame[:, 2])[..., None] * amplitude
    bent = bends(axis @ np.swapaxes(frame, 1, 2))[..., : lux.shape[1]].swapaxes(1, 2)
    above = share_above(samples.facet @ axis.T, frame[:, 2] @ axis.T, sharpness)
    free = free_share(other, sharpness)
    left = np.minimum(free, above)
    others = lux - bent[..., :narrow] @ given[:, :narrow]
    lost, whole = hidden.between(visibility.sites(vertices, samples.back), weights, lux.shape[1])
    lost, whole = lost[..., layer.fields], whole[:, layer.fields]
    some = lost[:, 0] > 0.0
    share = np.maximum(others[:, 0], 0.0) * some / np.where(some, np.maximum(whole, lost[:, 0]), 1.0)
    lost = (lost if lux.shape[1] == 1 else rotate_moments(lost, frame)) * (share * (1.0 - dark[:, None]))[:, None]
    others = others - lost - others * dark[:, None, None]
    # Occlusion of wider parts by the triangle's own plane, unknown at vertices, is limited to the remaining light.
    below = bent[..., narrow:] @ ((free - left)[..., None] * given)[:, narrow:]
    most = np.minimum(np.maximum(others[:, 0], 0.0), below[:, 0])
    below *= np.where(most > 0.0, most / np.where(most > 0.0, below[:, 0], 1.0), 0.0)[:, None]
    lux = others - below + bent[..., :narrow] @ (left[..., None] * given)[:, :narrow]
    if not count:
        return lux, seen

    to_world = np.einsum("nqi,nij->nqj", lobes.directions, frame)
    own, slopes = visibility.boundaries(vertices, weights, to_world, samples.back)
    share = sharpness / (sharpness + lobes.sharpness[..., None])
    between = share * other[:, None] + (1.0 - share) * own[..., None]
    free = free_share(between, np.broadcast_to(sharpness + lobes.sharpness[..., None], between.shape))
    parts = bright.by_lobes(to_world, lobes.sharpness)
    rest = seen - parts @ amplitude
    # Other light: gathered over the free part of the lobe, about its mean direction.
    steep = np.linalg.norm(slopes, axis=-1)
    cut = cut_lobe(own, np.minimum(steep, 1.0), lobes.sharpness)
    some = np.nonzero(cut.turn)
    turn, way = cut.turn[some][:, None], slopes[some] / steep[some][:, None]
    middle, sharper = (np.cos(turn) * to_world[some] + np.sin(turn) * way)[:, None], cut.sharpness[some][:, None]
    there = layer.gathered.by_lobes(middle @ layer.world_from_map, sharper)[..., layer.fields]
    rest[some] = (there - bright.by_lobes(middle, sharper) @ amplitude)[:, 0]
    return lux, np.maximum(rest * cut.share[..., None] + (parts * free) @ amplitude, 0.0)
