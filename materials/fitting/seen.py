"""Direction pairs as pictures show them, with what a BRDF shades to there and what an error there is seen as.

Points all over spheres, orthographic, under lights at every angle from the view. To first order, ΔE94 of a small error
is the length of `eye` times it, with the derivative of CIELAB at the reference itself: below (24/116)^3, where L* is
linear, its slope is finite, so that black needs no guard.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from ...spectral.difference import delta_e_xyz, lab_from_xyz
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM, interpolation_matrix
from ..brdf import Brdf
from ..directions import spherical
from ..factors import FactorPack
from ..protocol import sphere_protocol

# Lights stand at most this far from the view, radians. Those beyond the second angle light a surface from behind,
# where it shows few points and an error may be larger.
_FARTHEST, _BEHIND = np.radians([150.0, 117.0])
_BACK_SHARE = 0.25
_LEAST_COSINES = (0.003, 1e-4)
# Shares of the pairs that crowd about the mirror direction and towards the edge of the sphere; the least a pair counts.
_MIRROR, _EDGE, _LEAST_SHARE = 0.35, 0.25, 0.01
# Pairs drawn all over the hemispheres, beside so many others; each counts the least. Pictures show them so rarely that
# nothing else would keep terms from cancelling there, and one that does not is a speck of any colour.
_ANYWHERE = 0.15
# What the spectra's common basis may lose, root mean square, in L*.
_LOST = 0.005
# What an error is seen under, and what its square counts: the light of the protocol, a warm one, one of narrow bands.
# Without the others, spectra would be bent until D65 alone sees no difference.
_LIGHTS = (("D65", 1.0), ("A", 0.25), ("FL11", 0.25))
# How much an error counts that none of them shows: another light may.
_UNSEEN = 0.3
_BLOCK = 8192
# CIELAB's cube root ends here.
_KNEE = (24.0 / 116.0) ** 3


@dataclass(frozen=True, eq=False)
class SeenSamples:
    """N direction pairs, and the BRDF there in a basis of S spectra common to all packs.

    targets : f_r cos(theta_i) as `analysis` (L,S) has it; `synthesis` (S,L) leads back; on the working wavelengths.
    eye : turns a small error of `targets` into (ΔL*, ΔC*/S_C, ΔH*/S_H) of CIE 1994 under D65, A and FL11, one after
        another, each times the root of what the light counts.
    plain : weight of an error whatever its colour: what it would cost in L*, times a small share.
    share : how often a picture shows the pair, against how often it was drawn.
    xyz : of the pair under D65; Y of a perfect diffuser facing the light = 1. light_weights : XYZ of each coefficient.
    """

    wi: Float[np.ndarray, "N 3"]
    wo: Float[np.ndarray, "N 3"]
    targets: Float[np.ndarray, "N S"]
    eye: Float[np.ndarray, "N K S"]
    plain: Float[np.ndarray, " N"]
    share: Float[np.ndarray, " N"]
    xyz: Float[np.ndarray, "N 3"]
    analysis: Float[np.ndarray, "L S"]
    synthesis: Float[np.ndarray, "S L"]
    light_weights: Float[np.ndarray, "S 3"]

    @property
    def behind(self) -> Bool[np.ndarray, " N"]:
        """Where the light comes from behind."""
        return np.sum(self.wi * self.wo, axis=1) < np.cos(_BEHIND)

    def less(self, packs: tuple[FactorPack, ...]) -> SeenSamples:
        """The same samples with what packs shade to taken off the targets."""
        shaded = [pack.shade(self.wi, self.wo) @ (pack.basis.synthesis.T @ self.analysis) for pack in packs]
        return replace(self, targets=self.targets - sum(shaded, np.zeros_like(self.targets)))

    def delta_e(self, packs: tuple[FactorPack, ...]) -> Float[np.ndarray, " N"]:
        """ΔE94 of packs at every sample under D65."""
        xyz = self.xyz - self.less(packs).targets @ self.light_weights
        return delta_e_xyz(self.xyz, xyz, sphere_protocol(16).weights(WORKING_WAVELENGTHS_NM).sum(axis=0))


def seen_samples(brdf: Brdf, count: int, seed: int = 0) -> SeenSamples:
    """Some 0.6 `count` samples of a BRDF: of `count` pairs drawn, those above the horizon."""
    wi, wo, share = seen_pairs(count, seed, brdf.isotropic)
    same = np.array_equal(brdf.wavelengths_nm, WORKING_WAVELENGTHS_NM)
    resample = None if same else interpolation_matrix(brdf.wavelengths_nm, WORKING_WAVELENGTHS_NM).T
    spectra = np.empty((len(wi), len(WORKING_WAVELENGTHS_NM)))
    for start in range(0, len(wi), _BLOCK):
        rows = slice(start, start + _BLOCK)
        found = brdf.eval(wi[rows], wo[rows]) * wi[rows, 2:]
        spectra[rows] = found if resample is None else found @ resample
    observed = np.pi * sphere_protocol(16).weights(WORKING_WAVELENGTHS_NM)
    xyz = spectra @ observed
    slope = 116.0 / 3.0 * np.maximum(xyz[:, 1], _KNEE) ** (-2.0 / 3.0)
    bright = np.linalg.norm(observed, axis=1)
    bright = np.maximum(bright, 0.05 * bright.max())
    weighted = spectra * (bright * slope[:, None] * np.sqrt(share)[:, None])
    values, vectors = np.linalg.eigh(weighted.T @ weighted)
    values, vectors = np.maximum(values[::-1], 0.0), vectors[:, ::-1]
    energy = np.cumsum(values[::-1])[::-1]
    size = max(1, int(np.sum(energy > _LOST**2 * len(wi))))
    analysis, synthesis = bright[:, None] * vectors[:, :size], vectors[:, :size].T / bright
    light_weights = synthesis @ observed
    eye = np.concatenate([np.sqrt(counts) * _eye(spectra, synthesis, light) for light, counts in _LIGHTS], axis=1)
    eye *= np.sqrt(share)[:, None, None]
    # Coefficients have the size of XYZ: a spectrum of length 1 in the basis is about 1 in Y.
    plain = (_UNSEEN * slope) ** 2 * share
    return SeenSamples(wi, wo, spectra @ analysis, eye, plain, share, xyz, analysis, synthesis, light_weights)


def _eye(
    spectra: Float[np.ndarray, "N L"], synthesis: Float[np.ndarray, "S L"], light: str
) -> Float[np.ndarray, "N 3 S"]:
    """What `SeenSamples.eye` says of one light."""
    protocol = sphere_protocol(16, light=light)
    observed = np.pi * protocol.weights(WORKING_WAVELENGTHS_NM)
    return np.einsum("nkc,sc->nks", _lab_slopes(spectra @ observed, observed.sum(axis=0) / np.pi), synthesis @ observed)


def _lab_slopes(xyz: Float[np.ndarray, "N 3"], white: Float[np.ndarray, "3"]) -> Float[np.ndarray, "N 3 3"]:
    """d(L*, C*/S_C, H*/S_H)/d(XYZ) at a reference (CIE 116-1995); at grey, chroma is a* and hue b*."""
    slope = np.maximum(xyz / white, _KNEE) ** (-2.0 / 3.0) / 3.0 / white
    lab = lab_from_xyz(xyz, white)
    zero = np.zeros(len(xyz))
    along_a = np.stack([500.0 * slope[:, 0], -500.0 * slope[:, 1], zero], axis=-1)
    along_b = np.stack([zero, 200.0 * slope[:, 1], -200.0 * slope[:, 2]], axis=-1)
    chroma = np.hypot(lab[:, 1], lab[:, 2])
    coloured = chroma > 0
    cosine = np.divide(lab[:, 1], chroma, out=np.ones_like(chroma), where=coloured)[:, None]
    sine = np.divide(lab[:, 2], chroma, out=np.zeros_like(chroma), where=coloured)[:, None]
    lightness = np.stack([zero, 116.0 * slope[:, 1], zero], axis=-1)
    chromatic = (cosine * along_a + sine * along_b) / (1.0 + 0.045 * chroma)[:, None]
    hue = (cosine * along_b - sine * along_a) / (1.0 + 0.015 * chroma)[:, None]
    return np.stack([lightness, chromatic, hue], axis=1)


def seen_pairs(
    count: int, seed: int, isotropic: bool
) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 3"], Float[np.ndarray, " N"]]:
    """wi and wo of points on spheres under lights at every angle from the view; and what each counts.

    Behind them, some all over both hemispheres (`anywhere_pairs`).

    Some crowd about the mirror direction, on a square-root scale of theta_h, and some towards the edge, and count the
    less: a highlight of few pixels and grazing views are met too. Quasi-random from `seed`: even, and never the pixels
    of the protocol.
    """
    u = _even_points(count, 5, seed)
    away, turn = _FARTHEST * u[:, 0], 2.0 * np.pi * u[:, 3]
    light = np.stack([np.sin(away), np.zeros(count), np.cos(away)], axis=-1)
    middle = np.stack([np.sin(0.5 * away), np.zeros(count), np.cos(0.5 * away)], axis=-1)
    across = np.stack([middle[:, 2], np.zeros(count), -middle[:, 0]], axis=-1)
    around = 2.0 * np.pi * u[:, 2]
    cosine, sine = np.cos(around)[:, None], np.sin(around)[:, None]
    # Uniform over the disk, or over the hemisphere above it.
    edge = (u[:, 4] > 1.0 - _EDGE)[:, None]
    radius = np.where(edge, np.sqrt(1.0 - u[:, 1:2] ** 2), np.sqrt(u[:, 1:2]))
    anywhere = np.hstack([radius * cosine, radius * sine, np.sqrt(1.0 - radius**2)])
    theta = (0.5 * np.pi * u[:, 1] ** 2)[:, None]
    mirror = np.cos(theta) * middle + np.sin(theta) * (cosine * across + sine * np.array([0.0, 1.0, 0.0]))
    normal = np.where((u[:, 4] < _MIRROR)[:, None], mirror, anywhere)
    share = _share(normal, middle) * np.where(away > _BEHIND, _BACK_SHARE, 1.0)
    lit = (np.sum(normal * light, axis=-1) > _LEAST_COSINES[0]) & (normal[:, 2] > _LEAST_COSINES[1])
    normal, light, turn = normal[lit], light[lit], turn[lit]
    tangent = np.stack([normal[:, 2], np.zeros(len(normal)), -normal[:, 0]], axis=-1)
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    other = np.cross(normal, tangent)
    if not isotropic:
        cosine, sine = np.cos(turn)[:, None], np.sin(turn)[:, None]
        tangent, other = cosine * tangent + sine * other, cosine * other - sine * tangent
    frame = np.stack([tangent, other, normal], axis=1)
    wi, wo = anywhere_pairs(int(_ANYWHERE * count), seed, isotropic)
    return (
        np.concatenate([np.einsum("nij,nj->ni", frame, light), wi]),
        np.concatenate([frame[:, :, 2], wo]),
        np.concatenate([share[lit], np.full(len(wi), 4.0 * _LEAST_SHARE)]),
    )


def anywhere_pairs(count: int, seed: int, isotropic: bool) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
    """wi and wo, even in theta_i and theta_o, crowding towards the plane of incidence on either side; at most `count`.

    Those of lights that no sample has (`_FARTHEST`) are left out.
    """
    u = _even_points(count, 4, seed)
    theta_i, theta_o = (np.minimum(0.5 * np.pi * u[:, k], 0.5 * np.pi - 1e-3) for k in (0, 1))
    phi = 0.5 * np.pi * (1.0 - np.cos(2.0 * np.pi * u[:, 2]))
    phi = np.where(u[:, 2] < 0.5, phi, -phi)
    phi_i = np.zeros(count) if isotropic else 2.0 * np.pi * u[:, 3]
    wi, wo = spherical(theta_i, phi_i), spherical(theta_o, phi_i + phi)
    near = np.sum(wi * wo, axis=-1) > np.cos(_FARTHEST)
    return wi[near], wo[near]


def _share(normal: Float[np.ndarray, "N 3"], middle: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
    """Density of a picture's normals over that of all three ways to draw them, at most 1 / (1 - _MIRROR - _EDGE)."""
    sine = np.linalg.norm(np.cross(normal, middle), axis=-1)
    theta = np.arctan2(sine, np.sum(normal * middle, axis=-1))
    shown = np.maximum(normal[:, 2], 0.0) / np.pi
    # theta = pi/2 u^2 has the density (2 pi theta)^(-1/2); over the circle that this leaves.
    circle = 2.0 * np.pi * np.maximum(sine, 1e-12)
    mirror = np.where(theta < 0.5 * np.pi, 1.0 / np.sqrt(2.0 * np.pi * np.maximum(theta, 1e-12)) / circle, 0.0)
    edge = np.where(normal[:, 2] > 0.0, 0.5 / np.pi, 0.0)
    drawn = (1.0 - _MIRROR - _EDGE) * shown + _MIRROR * mirror + _EDGE * edge
    return np.maximum(np.divide(shown, drawn, out=np.zeros_like(shown), where=drawn > 0), _LEAST_SHARE)


def _even_points(count: int, dimensions: int, seed: int) -> Float[np.ndarray, "n d"]:
    """Evenly spread points of the unit cube from a random first one: steps are powers of 1/g, g^(d+1) = g + 1.

    Roberts' sequence, a Kronecker sequence of the generalised golden ratio.
    """
    root = 2.0
    for _ in range(64):
        root = (1.0 + root) ** (1.0 / (dimensions + 1))
    steps = root ** -np.arange(1.0, dimensions + 1)
    return np.mod(np.random.default_rng(seed).random(dimensions) + np.outer(np.arange(1, count + 1), steps), 1.0)
