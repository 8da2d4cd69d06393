"""Direction pairs as pictures show them, with what a BRDF shades to there and what an error there is seen as.

Points all over spheres, orthographic, under lights at every angle from the view. To first order, ΔE94 of a small error
is the length of `eye` times it, with the derivative of CIELAB at the reference itself: below (24/116)^3, where L* is
linear, its slope is finite, so that black needs no guard.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float

from ...spectral.difference import KNEE, lab_from_xyz
from ...spectral.projection import projection_matrix
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM
from ..brdf import Brdf
from ..directions import half_difference, spherical
from ..factors import FactorPack
from ..highlight import highlight_width
from ..protocol import LIGHT_ANGLES_DEG, LIGHTS, sphere_protocol

# Lights stand at most this far from the view, radians. Those beyond the second angle light a surface from behind,
# where it shows few points and an error may be larger.
FARTHEST, _BEHIND = np.radians([150.0, 117.0])
_BACK_SHARE = 0.25
_LEAST_COSINES = (0.003, 1e-4)
# Shares of the pairs that crowd about the mirror direction and towards the edge of the sphere; the least a pair counts.
_MIRROR, _EDGE, _LEAST_SHARE = 0.35, 0.25, 0.01
# What a highlight's own pixels count at least, however few pictures show.
_HIGHLIGHT_SHARE = 0.3
# Pairs drawn all over the hemispheres, beside so many others; each counts the least. Pictures show them so rarely that
# nothing else would keep terms from cancelling there, and one that does not is a speck of any colour.
_ANYWHERE = 0.15
# What the spectra's common basis may lose, root mean square, in L*.
_LOST = 0.02
# What the square of an error counts under each light that a fit is judged by. Under one alone, spectra would be bent
# until it sees no difference.
_LIGHT_SHARE = 0.3
# Share of what the eye makes of errors that may be counted as if it were colourless: what is left are few directions
# of colour at each sample, in which the lights of the protocol agree; and how many they are at most.
_BLURRED, _MOST_DIRECTIONS = 0.02, 4
# How much an error counts that none of them shows: another light may.
_UNSEEN = 0.3
_BLOCK = 8192


@dataclass(frozen=True, eq=False)
class SeenSamples:
    """N direction pairs, and the BRDF there in a basis of S spectra common to all packs.

    targets : f_r cos(theta_i) as `analysis` (L,S) has it; `synthesis` (S,L) leads back; on the working wavelengths.
    eye : K rows of S a sample, along the last axis: the sum of squares of `eye` times a small error of `targets` is
        that of (ΔL*, ΔC*/S_C, ΔH*/S_H) of CIE 1994 under every light of the protocol.
    plain : weight of an error whatever its colour: what it would cost in L*, times a small share.
    share : how often a picture shows the pair, against how often it was drawn.
    guards, limits : the last G pairs are held between limits (`guarded`), at these weights.
    xyz : of the pair under D65; Y of a perfect diffuser facing the light = 1.
    """

    wi: Float[np.ndarray, "N 3"]
    wo: Float[np.ndarray, "N 3"]
    targets: Float[np.ndarray, "N S"]
    eye: Float[np.ndarray, "K S N"]
    plain: Float[np.ndarray, " N"]
    share: Float[np.ndarray, " N"]
    xyz: Float[np.ndarray, "N 3"]
    analysis: Float[np.ndarray, "L S"]
    synthesis: Float[np.ndarray, "S L"]
    guards: Float[np.ndarray, " G"] = field(default_factory=lambda: np.empty(0))
    limits: Float[np.ndarray, "2 L"] | None = None

    @property
    def behind(self) -> Bool[np.ndarray, " N"]:
        """Where the light comes from behind."""
        return np.sum(self.wi * self.wo, axis=1) < np.cos(_BEHIND)

    def felt(self, error: Float[np.ndarray, "S N"]) -> Float[np.ndarray, "S N"]:
        """Half the gradient of what errors at the samples cost: the cost is the sum of `error` times this."""
        seen = np.einsum("ksn,sn->kn", self.eye, error)
        out = np.einsum("ksn,kn->sn", self.eye, seen)
        out += self.plain * error
        return out

    def stressed(self, weights: Float[np.ndarray, " N"]) -> SeenSamples:
        """The same samples, an error at each counting so many times as much."""
        return replace(self, eye=self.eye * np.sqrt(weights), plain=self.plain * weights)

    def thinned(self, step: int) -> SeenSamples:
        """Every `step`-th sample without the guards, each counting so many times as much."""
        some = slice(None, len(self.wi) - len(self.guards), step)
        return replace(
            self,
            wi=self.wi[some],
            wo=self.wo[some],
            targets=self.targets[some],
            plain=step * self.plain[some],
            eye=np.sqrt(step) * self.eye[:, :, some],
            guards=np.empty(0),
            share=step * self.share[some],
            xyz=self.xyz[some],
        )

    def guarded(
        self, wi: Float[np.ndarray, "G 3"], wo: Float[np.ndarray, "G 3"], limits: Float[np.ndarray, "2 L"], cost: float
    ) -> SeenSamples:
        """With further pairs, at which packs shall shade to pi f_r cos(theta_i) between two `limits`, no matter what.

        `cost` of leaving them by 0.02 at one wavelength. They come last, and count nothing while within their limits.
        """
        more = len(wi)
        join, zero = np.concatenate, np.zeros(more)
        return replace(
            self,
            wi=join([self.wi, wi]),
            wo=join([self.wo, wo]),
            targets=join([self.targets, np.zeros((more, self.targets.shape[1]))]),
            eye=join([self.eye, np.zeros((*self.eye.shape[:2], more))], axis=2),
            plain=join([self.plain, zero]),
            share=join([self.share, zero]),
            xyz=join([self.xyz, np.zeros((more, 3))]),
            guards=join([self.guards, np.full(more, cost / 0.02**2)]),
            limits=limits,
        )

    def cost(self, packs: tuple[FactorPack, ...]) -> float:
        """What the errors of packs cost at all samples together: the sum of their squared ΔE94, to first order."""
        left = self.less(packs).targets.T.copy()
        if len(self.guards):
            left[:, -len(self.guards) :] = 0.0
        return float(np.vdot(left, self.felt(left)))

    def less(self, packs: tuple[FactorPack, ...]) -> SeenSamples:
        """The same samples with what packs shade to taken off the targets."""
        shaded = [pack.shade(self.wi, self.wo) @ (pack.basis.synthesis.T @ self.analysis) for pack in packs]
        return replace(self, targets=self.targets - sum(shaded, np.zeros_like(self.targets)))


def seen_samples(brdf: Brdf, count: int, seed: int = 0) -> SeenSamples:
    """Some 0.6 `count` samples of a BRDF: of `count` pairs drawn, those above the horizon."""
    wi, wo, share = seen_pairs(count, seed, brdf.isotropic)
    share = np.maximum(share, _HIGHLIGHT_SHARE * _in_highlight(brdf, wi, wo))
    spectra = working_spectra(brdf, wi, wo)
    observed = np.pi * sphere_protocol(16).weights(WORKING_WAVELENGTHS_NM)
    xyz = spectra @ observed
    slope = 116.0 / 3.0 * np.maximum(xyz[:, 1], KNEE) ** (-2.0 / 3.0)
    bright = np.linalg.norm(observed, axis=1)
    bright = np.maximum(bright, 0.05 * bright.max())
    weighted = spectra * (bright * slope[:, None] * np.sqrt(share)[:, None])
    values, vectors = np.linalg.eigh(weighted.T @ weighted)
    values, vectors = np.maximum(values[::-1], 0.0), vectors[:, ::-1]
    energy = np.cumsum(values[::-1])[::-1]
    size = max(1, int(np.sum(energy > _LOST**2 * len(wi))))
    analysis, synthesis = bright[:, None] * vectors[:, :size], vectors[:, :size].T / bright
    # Coefficients have the size of XYZ: a spectrum of length 1 in the basis is about 1 in Y.
    plain = (_UNSEEN * slope) ** 2 * share
    eye, lost = _eye(spectra, synthesis)
    return SeenSamples(
        wi,
        wo,
        spectra @ analysis,
        eye * np.sqrt(share),
        plain + lost * share,
        share,
        xyz,
        analysis,
        synthesis,
    )


def working_spectra(brdf: Brdf, wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N L"]:
    """f_r cos(theta_i) on the working wavelengths, 1/sr."""
    same = np.array_equal(brdf.wavelengths_nm, WORKING_WAVELENGTHS_NM)
    resample = None if same else projection_matrix(brdf.wavelengths_nm, WORKING_WAVELENGTHS_NM).T
    spectra = np.empty((len(wi), len(WORKING_WAVELENGTHS_NM)))
    for start in range(0, len(wi), _BLOCK):
        rows = slice(start, start + _BLOCK)
        found = brdf.eval(wi[rows], wo[rows]) * wi[rows, 2:]
        spectra[rows] = found if resample is None else found @ resample
    return spectra


def _in_highlight(brdf: Brdf, wi: Float[np.ndarray, "N 3"], wo: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
    """Whether pairs are of a highlight's own pixels."""
    theta_h, theta_d, _, _ = half_difference(wi, wo)
    known = 0.5 * np.radians(LIGHT_ANGLES_DEG)
    widths = [highlight_width(brdf, angle)[0] for angle in known]
    return theta_h <= np.interp(theta_d, known, widths, right=0.0)


def _eye(
    spectra: Float[np.ndarray, "N L"], synthesis: Float[np.ndarray, "S L"]
) -> tuple[Float[np.ndarray, "K S N"], Float[np.ndarray, " N"]]:
    """What `SeenSamples.eye` says, by the principal directions of each sample's errors under all lights together; and
    the mean weight of the directions that are left out.
    """
    size = len(synthesis)
    gram = np.zeros((len(spectra), size, size))
    for light in LIGHTS:
        weights = sphere_protocol(16, light=light).weights(WORKING_WAVELENGTHS_NM)
        observed = np.pi * weights
        slopes = _lab_slopes(spectra @ observed, weights.sum(axis=0)) @ (synthesis @ observed).T
        gram += _LIGHT_SHARE * np.matmul(slopes.transpose(0, 2, 1), slopes)
    values, vectors = np.linalg.eigh(gram)
    values, vectors = np.maximum(values[:, ::-1], 0.0), vectors[:, :, ::-1]
    kept = np.cumsum(values.mean(axis=0))
    rows = min(int(np.sum(kept < (1.0 - _BLURRED) * kept[-1])) + 1, _MOST_DIRECTIONS, size)
    eye = np.sqrt(values[:, None, :rows]) * vectors[:, :, :rows]
    lost = values[:, rows:].sum(axis=1) / max(size - rows, 1)
    return np.ascontiguousarray(eye.transpose(2, 1, 0)), lost


def _lab_slopes(xyz: Float[np.ndarray, "N 3"], white: Float[np.ndarray, "3"]) -> Float[np.ndarray, "N 3 3"]:
    """d(L*, C*/S_C, H*/S_H)/d(XYZ) at a reference (CIE 116-1995); at grey, chroma is a* and hue b*."""
    slope = np.maximum(xyz / white, KNEE) ** (-2.0 / 3.0) / 3.0 / white
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
    away, turn = FARTHEST * u[:, 0], 2.0 * np.pi * u[:, 3]
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


def everywhere_angles(
    count: int, seed: int, isotropic: bool
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"], Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """theta_i, theta_o, phi_o - phi_i and phi_i (0 if isotropic) all over both hemispheres, in radians.

    Even in theta_i and theta_o, crowding towards the plane of incidence on either side; a third of them nearer and
    nearer to the mirror direction, and a third to the horizon.
    """
    u = _even_points(count, 5, seed)
    right = 0.5 * np.pi
    theta_i, theta_o = right * u[:, 0], right * u[:, 1]
    phi = right * (1.0 - np.cos(2.0 * np.pi * u[:, 2]))
    mirror, grazing = u[:, 4] < 1.0 / 3.0, u[:, 4] > 2.0 / 3.0
    theta_o = np.where(mirror, theta_i + right * (2.0 * u[:, 1] - 1.0) ** 3, theta_o)
    phi = np.where(mirror, np.pi * (1.0 - u[:, 2] ** 3), phi)
    theta_i, theta_o = (np.where(grazing, right * (1.0 - u[:, k] ** 2), t) for k, t in ((0, theta_i), (1, theta_o)))
    theta_i, theta_o = (np.clip(theta, 0.0, right - 1e-3) for theta in (theta_i, theta_o))
    phi = np.where(u[:, 2] < 0.5, phi, -phi)
    return theta_i, theta_o, phi, np.zeros(count) if isotropic else 2.0 * np.pi * u[:, 3]


def anywhere_pairs(count: int, seed: int, isotropic: bool) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
    """wi and wo, even in theta_i and theta_o, crowding towards the plane of incidence on either side; at most `count`.

    Those of lights that no sample has (`FARTHEST`) are left out: there packs only keep within bounds.
    """
    u = _even_points(count, 4, seed)
    theta_i, theta_o = (np.minimum(0.5 * np.pi * u[:, k], 0.5 * np.pi - 1e-3) for k in (0, 1))
    phi = 0.5 * np.pi * (1.0 - np.cos(2.0 * np.pi * u[:, 2]))
    phi = np.where(u[:, 2] < 0.5, phi, -phi)
    phi_i = np.zeros(count) if isotropic else 2.0 * np.pi * u[:, 3]
    wi, wo = spherical(theta_i, phi_i), spherical(theta_o, phi_i + phi)
    near = np.sum(wi * wo, axis=-1) > np.cos(FARTHEST)
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
