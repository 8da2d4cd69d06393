"""A BTF of bumps that shine, made on the spot: full rank, views and lights of UBO2003's rings; and a sky for it."""

import numpy as np
from metamer.lighting.environment import latlong
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.materials.btf.hemisphere import Hemisphere
from metamer.materials.btf.images import HeldImages
from metamer.spectral.basis import SpectralBasis
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
