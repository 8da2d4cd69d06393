"""The 2004 paper's way: a BTF on a draped cloth beside coloured walls, lit through transfer matrices in harmonics.

Only pixels of the cloth are judged. The matrices hold what parts reflect, as matt surfaces, so that another material is
all of the work anew; another light is a fold of clusters and a sum at each site, another view a sum at each pixel.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from ...lighting.camera import Camera
from ...lighting.environment.environment import EnvironmentLight
from ...lighting.mesh.mesh import Mesh
from ...lighting.mesh.shapes import cloth, plane
from ...lighting.reference.geometry import Tracer, visible_geometry
from ...lighting.reference.reference import reference_images
from ...lighting.scene import Part, Scene
from ...lighting.transfer.diffuse_albedo import even_albedo
from ...lighting.transfer.edge_refinement import placed
from ...lighting.transfer.hits import Hits, tangents
from ...lighting.transfer.operator import irradiance_operator
from ...lighting.transfer.regions import Regions
from ...lighting.vectors import orthonormal_frame
from ...materials.analytic import Lambert
from ...materials.btf.form import BtfForm, btf_form
from ...materials.btf.images import BtfImages
from ...materials.btf.surface import MeasuredBtf
from ...materials.core.surface import Surface
from ...spectral.basis import SpectralBasis
from ...spectral.difference import delta_e_xyz
from ...spectral.observers import observer
from ...spectral.spectrum import Spectrum
from ..btf.cases import btf_cases
from ..papers.harmonics import project_light
from ..papers.transfer_tensors.clustered_harmonic import ClusteredHarmonicTransfer, clustered_transfer
from ..papers.transfer_tensors.harmonic import HarmonicTransfer, harmonic_transfer
from ..papers.transfer_tensors.harmonic_btf import HarmonicBtf, products
from ..svbrdf.cases import window_sky
from .pixels import BUDGET, figures_of, seen_sites
from .scenes import SIDE

#: Name for `--case`.
NAME = "draped-cloth"
#: Bounces of the paths: what further ones add is less than their noise.
BOUNCES = 4
# Divisions of the cloth, and the longest edge of the other parts, in radii of the scene.
_DIVISIONS, _EDGE = 40, 0.12
# Coefficients of light on its way, and rays of a site for matrices.
_SIZE, _RAYS = 6, 512
_TEXTURED = "btf"


@dataclass(frozen=True, eq=False)
class Clothed:
    """A scene whose first part is covered by a BTF; its first light is the sky.

    images : of the BTF. surfaces : of all parts, original.
    """

    scene: Scene
    images: BtfImages
    surfaces: dict[str, Surface]


def clothed(images: BtfImages, divisions: int = _DIVISIONS) -> Clothed:
    """Return a cloth over a ball, on a red floor before a green wall, under a sky."""
    floor = plane(4, 4).placed(translate=(0.0, -0.3, 0.0))
    corners = np.array([[-2.0, -0.3, -1.2], [2.0, -0.3, -1.2], [2.0, 2.0, -1.2], [-2.0, 2.0, -1.2]])
    wall = Mesh(corners, np.tile([0.0, 0.0, 1.0], (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]))
    meshes = ((_TEXTURED, cloth(divisions)), ("red", floor), ("green", wall))
    camera = Camera(
        position=(0.6, 2.4, 3.2), target=(0.0, 0.3, 0.0), vertical_fov_deg=40, width=SIDE, height_px=SIDE, samples=1
    )
    parts = tuple(Part(name, mesh, name) for name, mesh in meshes)
    scene = Scene(parts, (window_sky(),), (camera,), observer("1931_2"))
    nm = images.basis.wavelengths_nm
    colours = {"red": [0.05, 0.05, 0.1, 0.7, 0.75], "green": [0.05, 0.3, 0.6, 0.15, 0.1]}
    matt = {
        name: Lambert(Spectrum.sampled(nm, np.interp(nm, np.linspace(400.0, 700.0, 5), values)))
        for name, values in colours.items()
    }
    return Clothed(scene, images, {_TEXTURED: MeasuredBtf(images, _means(images)), **matt})


def _means(images: BtfImages) -> Float[np.ndarray, "V Lt J"]:
    means = [
        [images.image(v, n).mean(axis=(0, 1)) for n in range(len(images.lights))] for v in range(len(images.views))
    ]
    return np.array(means)


@dataclass(frozen=True, eq=False)
class _Pixels:
    """Pixels that show the cloth: number, sites about them with their shares, where on the texture, to the viewer."""

    pixel: Int[np.ndarray, " n"]
    sites: Int[np.ndarray, "n 3"]
    shares: Float[np.ndarray, "n 3"]
    uv: Float[np.ndarray, "n 2"]
    wo: Float[np.ndarray, "n 3"]

    @classmethod
    def of(cls, scene: Scene, fine: Scene, hits: Hits) -> _Pixels:
        """Find the pixels of the first camera. fine : the scene as it is divided."""
        found = visible_geometry(scene, None, slice(None), Tracer(scene), with_uv=True, with_frames=True)
        assert found.uv is not None
        ours = np.flatnonzero(found.part == 0)
        seen = seen_sites(fine, hits)
        both, first, second = np.intersect1d(found.pixel[ours], seen.pixel, return_indices=True)
        ours = ours[first]
        # Points that show their back lie in another frame than the sites there.
        return cls(both, seen.sites[second], seen.shares[second], found.uv[ours], found.wo[ours])

    def mixed(self, arriving: Float[np.ndarray, "S K J B"]) -> Float[np.ndarray, "n K J B"]:
        """Compute what arrives at pixels, linear between sites."""
        return np.einsum("nk,nk...->n...", self.shares, arriving[self.sites], optimize=True)


def draped_rows(
    progress: Callable[[str], None], images: BtfImages | None = None, divisions: int = _DIVISIONS
) -> list[dict]:
    """Return the paper's clusters, and the matrices as they are: rows as of `benchmark.run`."""
    progress(f"{NAME}: a BTF")
    case = clothed(btf_cases(None, False)[0].registered() if images is None else images, divisions)
    scene, light = case.scene, case.scene.lights[0]
    assert isinstance(light, EnvironmentLight)
    form = btf_form(case.images, name="lpca")
    assert isinstance(form, BtfForm)
    gathering = HarmonicBtf(texels=form.texels)
    progress(f"{NAME}: transfer matrices")
    begin = time.process_time()
    fine, hits, exact, basis = _transfer(case)
    matrices_s = time.process_time() - begin
    progress(f"{NAME}: clusters")
    compressed = clustered_transfer(exact)
    clusters_s = time.process_time() - begin - matrices_s
    pixels = _Pixels.of(scene, fine, hits)
    progress(f"{NAME}: paths of {BOUNCES} bounces")
    truth = reference_images(scene, None, case.surfaces, budget=BUDGET, bounces=BOUNCES)
    want = truth.xyz[0].reshape(-1, 3)[pixels.pixel]
    scale = np.pi / float(scene.viewing.reference_illuminance_lux)
    product = products(form.texels.form.basis, basis, light.spectra, scene.observer, scale)
    found = []
    for method, transfer, seconds in (
        ("paper-2004", compressed, matrices_s + clusters_s),
        ("paper-2004, no clusters", exact, matrices_s),
    ):
        values, relight = _relit(transfer, light, pixels, gathering, product, seconds)
        off = delta_e_xyz(want, np.maximum(values, 0.0), scene.adopted_white())
        found.append(
            {
                "scene": NAME,
                "vertices": len(hits.sites),
                "regions": len(scene.parts),
                "method": method,
                "at": "pixels",
                "rays": _RAYS,
                "bounces": BOUNCES,
                "precompute_cpu_seconds": seconds,
                "bytes": transfer.nbytes,
                "relight_ms": relight,
                "light": "sky",
                "delta_e94": figures_of(off),
                "reference_noise": None if truth.noise is None else float(max(truth.noise.mean)),
            }
        )
    return found


def _relit(
    transfer: HarmonicTransfer | ClusteredHarmonicTransfer,
    light: EnvironmentLight,
    pixels: _Pixels,
    gathering: HarmonicBtf,
    product: Float[np.ndarray, "K P J 3"],
    seconds: float,
) -> tuple[Float[np.ndarray, "n 3"], dict[str, float]]:
    """XYZ at pixels, and milliseconds."""
    # Work done only once: tables, and the order of sums.
    _ = gathering.table
    transfer.lit(project_light(light))
    begin = time.perf_counter()
    arriving = transfer.lit(project_light(light))
    lit = time.perf_counter()
    values = gathering.xyz(pixels.uv, pixels.wo, pixels.mixed(arriving), product)
    done = time.perf_counter()
    view, light_ms = 1e3 * (done - lit), 1e3 * (lit - begin)
    return values, {"view": view, "material": 1e3 * seconds, "light": light_ms, "all": view + light_ms + 1e3 * seconds}


def _transfer(case: Clothed) -> tuple[Scene, Hits, HarmonicTransfer, SpectralBasis]:
    """Return the scene as it is divided, its rays, the matrices of all sites, and the basis of the light that
    arrives."""
    scene = case.scene
    bodies = placed(scene, _EDGE, most=0.0)
    hits = bodies.traced()
    reflected = np.stack([even_albedo(case.surfaces[part.material]) for part in scene.parts])
    nm = case.images.basis.wavelengths_nm
    spectra = [np.ones((1, len(nm))), reflected]
    for _ in range(2):
        spectra.append((spectra[-1][:, None] * reflected).reshape(-1, len(nm)))
    weights = np.stack([scene.observer.weights(one, nm) for one in scene.lights[0].spectra])
    basis = SpectralBasis.balanced(np.concatenate(spectra), weights.reshape(-1, len(nm)).T, _SIZE, nm)
    regions = Regions(hits.part_of_site, reflected, basis)
    frames = _frames(bodies.scene, hits)
    matrices = harmonic_transfer(bodies, hits, regions, frames, irradiance_operator(hits), _RAYS)
    return bodies.scene, hits, matrices, basis


def _frames(scene: Scene, hits: Hits) -> Float[np.ndarray, "S 3 3"]:
    """Axes of all sites of a scene as it is divided: on fronts along the texture, as pixels have them."""
    normals = hits.sites.normals
    found = np.stack([*tangents(normals), normals], axis=1)
    first = 0
    for part in scene.parts:
        mesh, last = part.mesh, first + len(part.mesh.faces)
        if mesh.uv is not None:
            site = hits.corners[first:last]
            along = mesh.tangents.directions[mesh.tangents.faces]
            handedness = np.repeat(mesh.tangents.handedness, 3)
            found[site.ravel()] = orthonormal_frame(normals[site.ravel()], along.reshape(-1, 3), handedness)
        first = last
    return found
