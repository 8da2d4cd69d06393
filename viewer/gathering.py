"""What samples gather of a light that spreads, in numpy; twin of `gather.frag`."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from ..materials.points import Points
from ..materials.terms import Terms
from .keeping import SpreadLayer

# Samples at once: their lobes and what those see take some 30 MB.
_BLOCK = 1 << 15


def gathered_terms(layer: SpreadLayer, points: Points, frame: Float[np.ndarray, "N 3 3"]) -> Terms:
    """Terms of a layer at N samples: for each of its fields the form's, rounded up to fours.

    XYZ = pi / E_ref sum over lobes of the integral of f_r cos(theta_i) times the mean luminance under the lobe (Wang et
    al. 2009, eq. 41), and for the cosine its integral times E / pi.
    """
    width = layer.rank // (layer.fields.stop - layer.fields.start)
    value = np.zeros((len(points), layer.fields.stop - layer.fields.start, width))
    for start in range(0, len(points), _BLOCK):
        rows = slice(start, start + _BLOCK)
        lobes = layer.form.lobes(points.chosen(rows))
        # From the local frame to the world, and on to the map.
        to_map = np.einsum("nij,jk->nik", frame[rows], layer.world_from_map)
        rank = lobes.matt.shape[1]
        lux = layer.gathered.by_normals(to_map[:, 2])[:, layer.fields]
        found = lux[:, :, None] / np.pi * lobes.matt[:, None]
        if layer.form.count:
            directions = np.einsum("nqi,nij->nqj", lobes.directions, to_map)
            seen = layer.gathered.by_lobes(directions, lobes.sharpness)[..., layer.fields]
            found += np.einsum("nqk,nqr->nkr", seen, lobes.value)
        value[rows, :, :rank] = found
    return Terms(layer.scale * value.reshape(len(points), -1))
