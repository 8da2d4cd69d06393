"""Indirect light for renderings: incident at sites from other surfaces, linear on triangles between them.

The radiosity of all sites (`bounces`) is gathered along the rays of each (`hits`): illuminance, its moments and a
smooth radiance, so that surfaces between sites may have their own normals and lobes other than a cosine. Coefficient j
for a light's spectrum s_k is light of the spectrum s_k b_j, with b_j of the basis's synthesis, and is rendered as one
more field of an environment light.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from ...materials.core.environment_form import BENDS, bends
from ...materials.core.fast import Fast
from ...runtime.errors import InputError
from ...spectral.basis import SpectralBasis
from ...spectral.palette import Palette, SentPalette
from ...spectral.spectrum import Spectrum
from ...spectral.wavelengths import interpolation_matrix
from ..mesh.convexity import is_convex
from ..scene import Scene
from ..vectors import dot
from ..visibility.blocked_probes import beside_shut, edges
from ..visibility.edge_bisection import Halving
from ..visibility.occluders import Occluders
from ..visibility.sites import scaled_triangles
from .bounce_solver import followed
from .bounces import ENOUGH
from .diffuse_albedo import EVEN_Z, EVEN_ZZ
from .direct import direct_illuminance
from .hits import Hits
from .radiance_maps import RadianceMaps
from .ray_light import MOST_GLOSSY, RayLight
from .transport import Transport

#: Values per site and field: nine moments, three of the flux, nine of the radiance.
OF_SITE = 2 * BENDS + 3
FLUX, RADIANCE = slice(BENDS, BENDS + 3), slice(BENDS + 3, OF_SITE)
#: Least number of rays per site that determines the moments.
LEAST_RAYS = 16
#: Largest number of glossy sites with radiance maps, some 10 KB each.
MOST_MAPS = 100_000
# Lower clamp of the cosine in a ray's 1 / cosine weight of the flux.
_GRAZING = 0.05
# Rays per block.
_AT_ONCE = 1 << 17


@dataclass(frozen=True, eq=False)
class IndirectLight:
    """Indirect light at S sites, in F = K J fields: coefficient j of `basis` for light k.

    at_sites (S, 21, F) : illuminance, lux, and its moments (`bends`, world axes), as in `HiddenLight.lost`; the flux,
        the integral of radiance times direction over the hemisphere; and coefficients of `bends` that approximate the
        radiance from each direction, lux / sr.
    spectra : of the K lights. refinement, fronts, backs : see `Transport`.
    asked : `Scene.bounces`. bounces : largest number of surfaces on a light path.
    left : estimate of the largest ΔE94 of any site by further bounces.
    words : summary of bounces, sites, rays and seconds.
    maps : incident radiance at sites of glossy parts, finer than polynomials; None without such parts.
    radiant : see `Followed`.
    """

    at_sites: Float[np.ndarray, "S 21 F"]
    spectra: tuple[Spectrum, ...]
    basis: SpectralBasis
    refinement: Halving
    fronts: Int[np.ndarray, " V"]
    backs: Int[np.ndarray, " V"]
    asked: int | Literal["auto"]
    bounces: int
    left: float
    words: str
    maps: RadianceMaps | None = None
    radiant: float | None = None

    @property
    def fields(self) -> int:
        """Number of fields, F."""
        return self.at_sites.shape[2]

    def coloured(self, palette: Palette, field: int) -> tuple[Spectrum, Palette]:
        """Return a light's spectrum, and the palette that has the same colours under it as `palette` under a field."""
        light, coefficient = divmod(field, self.basis.size)
        function, nm = self.basis.reconstruct(np.eye(self.basis.size)[coefficient]), self.basis.wavelengths_nm
        if self.radiant is not None:
            return self.spectra[light], SentPalette.of_power(palette, self.radiant * function, nm)
        own = palette.wavelengths_nm
        return self.spectra[light], Palette(
            palette.samples * (interpolation_matrix(nm, own) @ function), SpectralBasis.sampled(own)
        )

    def near(
        self, faces: Int[np.ndarray, " N"], weights: Float[np.ndarray, "N 3"], back: Bool[np.ndarray, " N"]
    ) -> tuple[Int[np.ndarray, "N 3"], Float[np.ndarray, "N 3"]]:
        """Return the sites around points, given by triangles and barycentric weights, and the sites' weights.

        The inside of a solid is dark: its site has weight 0.
        """
        vertices, shares = self.refinement.located(faces, weights)
        sites = np.where(back[:, None], self.backs[vertices], self.fronts[vertices])
        return np.maximum(sites, 0), np.where(sites >= 0, shares, 0.0)


def arriving(hits: Hits, light: RayLight) -> Float[np.ndarray, "S 21 F"]:
    """Compute the light incident at each site from all others (`IndirectLight.at_sites`), float32.

    Rays are cosine-distributed: with radiosity B = pi L the moments are means of B times polynomials, and the flux is
    the mean of B times direction over cosine. The radiance is the least-squares fit of polynomials over the site's
    rays; its flux is known in closed form, and rays estimate only that of the residual.
    """
    count, fields = len(hits.sites), light.radiosity.shape[1]
    found = np.empty((count, OF_SITE, fields), np.float32)
    step = max(1, _AT_ONCE // hits.rays)
    for start in range(0, count, step):
        rows = slice(start, min(start + step, count))
        to = hits.directions(rows)
        sent = light.along(hits, np.arange(rows.start, rows.stop), to)
        bent = bends(to)
        moments = np.einsum("nrb,nrf->nbf", bent, sent) / hits.rays
        square = np.einsum("nrb,nrc->nbc", bent, bent) / hits.rays
        radiance = np.linalg.solve(square, moments) / np.pi
        found[rows, :BENDS], found[rows, RADIANCE] = moments, radiance
        normals = hits.sites.normals[rows]
        cosine = np.maximum(np.einsum("nri,ni->nr", to, normals), _GRAZING)
        rest = sent - np.pi * np.einsum("nrb,nbf->nrf", bent, radiance)
        found[rows, FLUX] = np.einsum("nri,nrf->nif", to / cosine[..., None], rest) / hits.rays
        found[rows, FLUX] += _smooth_flux(radiance, normals)
    return found


def _smooth_flux(radiance: Float[np.ndarray, "n 9 F"], normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3 F"]:
    """Integrate the polynomials times direction over the hemisphere about each normal.

    For 1 it is pi n, for a vector g times direction 2 pi / 3 g, and for a traceless symmetric matrix Q pi / 4 (2 Q n -
    n (n Q n)).
    """
    xy, yz, xz, uneven, steep = (radiance[:, k] for k in range(4, 9))
    x, y, z = (normals[:, k, None] for k in range(3))
    along = np.stack(
        [
            (uneven - steep) * x + 0.5 * (xy * y + xz * z),
            (-uneven - steep) * y + 0.5 * (xy * x + yz * z),
            2.0 * steep * z + 0.5 * (xz * x + yz * y),
        ],
        axis=1,
    )
    inner = np.einsum("ni,nif->nf", normals, along)
    straight = np.pi * radiance[:, 0] - 0.25 * np.pi * inner
    return normals[:, :, None] * straight[:, None] + 2.0 / 3.0 * np.pi * radiance[:, 1:4] + 0.5 * np.pi * along


def light_at(
    at: Float[np.ndarray, "N 21 F"], smooth: Float[np.ndarray, "N 3"], normal: Float[np.ndarray, "N 3"]
) -> tuple[Float[np.ndarray, "N 9 F"], Float[np.ndarray, "N 9 F"]]:
    """Return the moments on surfaces of given normals, world axes, and the radiance's coefficients.

    smooth : normals interpolated between sites. For another normal, as by a normal map, the illuminance changes by the
    flux, and half of the decrease of the cosine is added back: exact for uniform light from above `smooth`. The moments
    change as those of uniform light.
    """
    flux = np.einsum("ni,nif->nf", normal - smooth, at[:, FLUX])
    more = flux + 0.5 * (1.0 - dot(normal, smooth))[:, None] * at[:, 0]
    moments = at[:, :BENDS].copy()
    moments[:, 0] += more
    # The moment of z along the normal, and that of 3 zz - 1 as a traceless symmetric matrix.
    x, y, z = normal.T[:, :, None]
    moments[:, 1:4] += EVEN_Z * normal[:, :, None] * more[:, None]
    even = 0.5 * EVEN_ZZ * more
    for place, part in ((4, x * y), (5, y * z), (6, x * z), (7, x * x - y * y), (8, 3.0 * z * z - 1.0)):
        moments[:, place] += even * part
    return moments, at[:, RADIANCE]


def radiance_under_lobes(
    radiance: Float[np.ndarray, "N 9 F"], directions: Float[np.ndarray, "N Q 3"], sharpness: Float[np.ndarray, "N Q"]
) -> Float[np.ndarray, "N Q F"]:
    """Return the mean radiance under spherical Gaussians: polynomials of degree l are attenuated like harmonics."""
    first, second = lessened(sharpness)
    shares = bends(directions)
    shares[..., 1:4] *= first[..., None]
    shares[..., 4:] *= second[..., None]
    return np.einsum("nqb,nbf->nqf", shares, radiance)


def lessened(sharpness: Float[np.ndarray, "*n"]) -> tuple[Float[np.ndarray, "*n"], Float[np.ndarray, "*n"]]:
    """Compute the attenuation of harmonics of degree 1 and 2 by a normalised Gaussian of a sharpness > 0.

    a = coth(lambda) - 1 / lambda and 1 - 3 a / lambda; by series where terms cancel.
    """
    small = sharpness < 0.2
    whole = np.where(small, 1.0, sharpness)
    exact = 1.0 / np.tanh(whole) - 1.0 / whole
    first = np.where(small, sharpness / 3.0 * (1.0 - sharpness**2 / 15.0), exact)
    second = np.where(small, sharpness**2 / 15.0 * (1.0 - 2.0 * sharpness**2 / 21.0), 1.0 - 3.0 * exact / whole)
    return first, second


def needs_none(scene: Scene) -> bool:
    """Return whether a scene has no interreflection: a single convex body."""
    return len(scene.parts) == 1 and is_convex(scene.parts[0].mesh)


def indirect_light(
    scene: Scene,
    surfaces: Mapping[str, Fast],
    transport: Transport,
    shown_in: Sequence[Spectrum] = (),
    enough: float = ENOUGH,
    progress: Callable[[int, int, str], None] = lambda done, total, name: None,
) -> IndirectLight:
    """Compute indirect light with `scene.bounces` bounces or, for "auto", until further ones are invisible.

    Direct light is reflected with the materials' BRDFs, by direction where they are glossy (`RayLight`). For later
    bounces every material is diffuse with its albedo for uniform light, at each wavelength, a texture with the mean of
    its texels around each site; the receiving surface keeps its full BRDF. With fluorescence, light is represented as
    radiance, and textures reflect with their mean.

    Parameters
    ----------
    surfaces : by material id. transport : of the scene, with any materials. shown_in : spectra that may replace the
        lights' own; with fluorescence each needs its own indirect light.
    enough : largest ΔE94 of any site that omitted bounces may cause.
    progress : called with (steps done, number of steps, "bounces").

    Returns
    -------
    IndirectLight : with 0 bounces if none changes any site by more than `enough`.

    Raises
    ------
    InputError : a material with a reflectance of 1 or more; fewer than `LEAST_RAYS` rays per site.
    """
    start, hits = perf_counter(), transport.hits
    if hits.rays < LEAST_RAYS:
        words = f"{LEAST_RAYS} or more of each vertex"
        raise InputError("too few rays for a picture", field="rays", found=hits.rays, expected=words)
    occluders = Occluders(scaled_triangles(transport.fine).astype(np.float32))
    progress(0, 4, "bounces")
    spectra, which, lux = _by_spectrum(scene, direct_illuminance(scene, hits.sites, occluders))
    progress(1, 4, "bounces")
    found = followed(scene, surfaces, transport, spectra, which, lux, shown_in, enough)
    progress(2, 4, "bounces")
    sites = np.flatnonzero(np.isin(hits.part_of_site, found.glossy))
    # `found` counts the bounces of the light sent; its arrival at a surface is one more.
    none = scene.bounces == 0 or (scene.bounces == "auto" and found.bounces == 0)
    bounces = 0 if none else found.bounces + 1
    at, maps = np.zeros((len(hits.sites), OF_SITE, 0), np.float32), None
    if not none:
        at = beside_shut(arriving(hits, found.sent), hits.shut, edges(np.concatenate([hits.corners, hits.backs])))
        progress(3, 4, "bounces")
        if 0 < len(sites) <= MOST_MAPS:
            maps = RadianceMaps.of(hits, found.sent, sites, at[:, RADIANCE])
    progress(4, 4, "bounces")
    words = (
        f"{bounces or 'no'} {'bounce' if bounces == 1 else 'bounces'} of light between surfaces: {len(hits.sites):,} "
        f"sites, {hits.rays} rays each, {found.basis.size} numbers a spectrum, {perf_counter() - start:.1f} s; more "
        f"would change no site by more than ΔE94 {found.left:.2g}"
    )
    if not none and found.sent.glossy is None and len(sites):
        words += f"; {len(sites):,} glossy sites pass light on as matt ones, for they are more than {MOST_GLOSSY:,}"
    if not none and len(sites) > MOST_MAPS:
        words += f"; highlights without detail, for {len(sites):,} glossy sites are more than {MOST_MAPS:,}"
    where = transport.refinement, transport.fronts, transport.backs
    left, radiant = found.left, found.radiant
    return IndirectLight(at, found.spectra, found.basis, *where, scene.bounces, bounces, left, words, maps, radiant)


def _by_spectrum(
    scene: Scene, direct: Sequence[Float[np.ndarray, "S _"]]
) -> tuple[tuple[Spectrum, ...], list[int], Float[np.ndarray, "S K"]]:
    """Return the distinct spectra of all lights, the index of each light's spectra among them, and the direct
    illuminance by each.
    """
    found: dict[tuple[bytes, bytes], tuple[Spectrum, np.ndarray]] = {}
    for light, lux in zip(scene.lights, direct, strict=True):
        for spectrum, one in zip(light.spectra, lux.T, strict=True):
            before = found.get(spectrum.key)
            found[spectrum.key] = spectrum, one if before is None else before[1] + one
    spectra, columns = zip(*found.values(), strict=True)
    keys = list(found)
    which = [keys.index(spectrum.key) for light in scene.lights for spectrum in light.spectra]
    return spectra, which, np.stack(columns, axis=1)
