"""A BTF of bumps that shine, made on the spot: full rank, views and lights of UBO2003's rings; and a sky for it."""

import numpy as np
from metamer.lighting.environment import latlong
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.materials.btf.hemisphere import Hemisphere
from metamer.materials.btf.images import HeldImages
from metamer.materials.btf.metric import folding_of
from metamer.materials.core.environment_form import bends
from metamer.materials.core.points import Points
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.upsampling import upsampling
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM

RINGS = ((0, 360), (15, 60), (30, 30), (45, 20), (60, 18), (75, 15))


def of_degrees(degrees):
    theta, phi = np.radians(np.asarray(degrees, dtype=float)).T
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)


def rings(count=6):
    return of_degrees([(theta, phi) for theta, step in RINGS[:count] for phi in range(0, 360, step)])


def rgb_basis():
    spectra = upsampling().corners.T
    return SpectralBasis("rgb", WORKING_WAVELENGTHS_NM, np.linalg.pinv(spectra).T, spectra)


def bumps(height=12, width=16, views=5, lights=5, shine=0.2, seed=0, basis=None):
    """Smooth bumps with a body of their own colour and a highlight: nearest to a normal map, without shadows."""
    draw = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width] * 2.0 * np.pi
    lean = 0.3 * np.stack([np.sin(x / width) * np.cos(2 * y / height), np.cos(y / height + 1.0)], axis=2)
    normal = np.concatenate([lean, np.ones((height, width, 1))], axis=2)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    basis = rgb_basis() if basis is None else basis
    colour = draw.uniform(0.1, 0.6, (height, width, basis.size)) * np.linspace(0.5, 1.0, basis.size)
    to_view, to_light = rings(views), rings(lights)
    half = to_view[:, None] + to_light
    half /= np.linalg.norm(half, axis=2, keepdims=True)
    body = np.maximum(np.einsum("ld,hwd->lhw", to_light, normal), 0.0)[None, ..., None] * colour / np.pi
    glint = (
        shine
        * np.maximum(np.einsum("vld,hwd->vlhw", half, normal), 0.0)[..., None] ** 12
        * to_light[:, 2, None, None, None]
    )
    return HeldImages(Hemisphere(to_view), Hemisphere(to_light), (body + glint).astype(np.float32), basis)


def sky(fields):
    """Light that is bright in one place, and not the same from below."""
    to = latlong.texel_directions(32, 64)
    made = []
    for number in range(fields):
        axis = np.array([np.sin(number + 0.5), 0.6, np.cos(number + 0.5)])
        patch = np.exp(20.0 * (to @ (axis / np.linalg.norm(axis)) - 1.0))
        made.append(1.0 + 0.5 * np.sin(3.0 * to[..., 0] + number) + 3.0 * patch + 0.5 * to[..., 1])
    spectra = tuple(illuminant(name) for name in ("D65", "A"))[:fields]
    return EnvironmentLight(np.array(made), spectra, rotation_deg=-40.0)


def gathering_error(form, count):
    """ΔE94 of what looks at a form gather of a sky, beside f_r cos times light summed up over every texel of it."""
    light, draw = sky(1), np.random.default_rng(1)
    wo = np.abs(draw.normal(size=(count, 3))) + np.array([0.0, 0.0, 0.4])
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    uv = draw.uniform(size=(count, 2))
    height, width = light.fields.shape[1:]
    to, angles = latlong.texel_directions(height, width).reshape(-1, 3), latlong.solid_angles(height, width)
    # The sky's y is the surface's normal.
    local = np.stack([to[:, 0], -to[:, 2], to[:, 1]], axis=1)
    luminance = light.fields[0].ravel() * np.repeat(angles, width)
    truth = np.empty((count, form.rank))
    for number in range(count):
        points = Points(local, np.broadcast_to(wo[number], local.shape), np.broadcast_to(uv[number], (len(local), 2)))
        truth[number] = luminance @ form.texels.terms(points).value
    gathering = form.environment_form()
    lobes = gathering.lobes(Points(wo, wo, uv))
    moments = luminance @ (bends(local) * np.maximum(local[:, 2:], 0.0)) / np.pi
    found = np.einsum("b,nbj->nj", moments, np.broadcast_to(lobes.matt, (count, *lobes.matt.shape[1:])))
    # Lobes of all looks, or of each.
    shape = (count, gathering.count)
    directions, sharpness = np.broadcast_to(lobes.directions, (*shape, 3)), np.broadcast_to(lobes.sharpness, shape)
    for number in range(count):
        sharp = sharpness[number]
        gaussians = np.exp(sharp * (local @ directions[number].T - 1.0)) * sharp / (2 * np.pi * -np.expm1(-2 * sharp))
        found[number] += np.einsum("q,qj->j", luminance @ gaussians, lobes.value[number])
    basis = form.texels.form.basis
    to_xyz = folding_of(("D65",)).coefficients(basis) / truth.mean() * 0.2
    return delta_e_xyz(truth @ to_xyz, found @ to_xyz, folding_of(("D65",)).weights(basis.wavelengths_nm).sum(axis=0))
