"""Our way as a method: kept rays, materials and lights as they are, at sites and at pixels, beside paths from both."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from ...lighting.environment.environment import EnvironmentLight
from ...lighting.reference.bounces import BounceSum
from ...lighting.reference.geometry import Tracer, VisibleGeometry, visible_geometry
from ...lighting.transfer.edge_refinement import between_sites
from ...lighting.transfer.precomputation import Precomputation
from ...lighting.vectors import dot, unit
from ...materials.core.scattering import Scattering
from ...spectral.difference import delta_e_xyz
from ...spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM
from ..papers.site_relighting.interpolation import SurfacePoints, exits_between
from ..papers.site_relighting.relighting import Relighting
from ..timing import best_ms
from .pixels import ALL, Seen, Truths, figures_of, pixel_differences, seen_sites
from .scenes import TransferScene

#: Sites that paths start from, chosen among those that the camera looks at; paths of each, twice, and a seed.
SITES, PATHS, SEED = 600, 1024, 11


@dataclass(frozen=True, eq=False)
class TracedGeometry:
    """The rays of a scene, for any light: seen, of its camera; cpu_seconds, of all that lights leave as it is."""

    prepared: Precomputation
    seen: Seen
    cpu_seconds: float

    @classmethod
    def of(cls, case: TransferScene, rays: int, longest_edge: float, progress: Callable[[str], None]) -> TracedGeometry:
        """rays : of each site."""
        progress(f"{case.name}: {rays} rays of each site")
        start = time.process_time()
        prepared = Precomputation.of(case.scene, rays, longest_edge)
        _ = prepared.by_part, prepared.later, prepared.sky_operator, prepared.occluders
        _ = Relighting.of(case.scene, case.materials, prepared).rays.sky_in_cells
        spent = time.process_time() - start
        return cls(prepared, seen_sites(prepared.scene, prepared.hits), spent)


@dataclass(frozen=True, eq=False)
class OurMethod:
    """A scene under a light, ready to be relit."""

    case: TransferScene
    state: Relighting
    geometry: TracedGeometry

    @classmethod
    def of(cls, case: TransferScene, geometry: TracedGeometry) -> OurMethod:
        """geometry : of the scene."""
        return cls(case, Relighting.of(case.scene, case.materials, geometry.prepared), geometry)

    @property
    def seen(self) -> Seen:
        """Sites about pixels."""
        return self.geometry.seen

    @property
    def eye(self) -> Float[np.ndarray, "3"]:
        """Position of the scene's camera."""
        return np.asarray(self.case.scene.camera().position, dtype=float)

    def relight_ms(self) -> dict[str, float]:
        """Time colours at all sites: of another view, another material on the first glossy part and (`matt`) on the
        first matt one, another light, and of all: view, glossy material and light. No change is timed twice.
        """
        state, light = self.state, self.state.lights[0]
        assert isinstance(light, EnvironmentLight)
        eye, steps = self.eye, iter(range(1, 1000))

        def changed(glossy: bool, state: Relighting = state) -> Relighting:
            part = self.case.scene.parts[int(np.argmax(state.glossy == glossy))]
            old, share = self.case.materials[part.material], 1.0 - 0.01 * next(steps)
            parameters = (old.parameters[0], share * old.parameters[1])
            surface = replace(old, parameters=parameters) if glossy else replace(old, diffuse=share * old.diffuse)
            return state.with_material(part.name, surface)

        def turned(state: Relighting = state) -> Relighting:
            return state.with_lights(replace(light, rotation_deg=light.rotation_deg + next(steps)))

        state.exits(eye)
        found = {
            "material": best_ms(lambda: changed(True).exits(eye)),
            "matt": best_ms(lambda: changed(False).exits(eye)),
            "light": best_ms(lambda: turned().exits(eye)),
            "view": best_ms(lambda: state.exits(eye + 0.01 * next(steps))),
            "all": best_ms(lambda: changed(True, turned()).exits(eye + 0.01 * next(steps))),
        }
        return found

    def rows(self, bounces: tuple[int | None, ...], truths: Truths) -> Iterator[dict]:
        """Yield a row for each number of bounces, at pixels and at sites; None is until nothing is left.

        Direct light at pixels is that of paths without a bounce: renderers have it at each pixel, and sites do not. At
        sites both sides have the same direct light, every part as a matt one.
        """
        case, relight = self.case, self.relight_ms()
        direct = truths.picture(0)
        own = direct.xyz[0].reshape(-1, 3)[self.seen.pixel]
        sites = self._chosen()
        glossy = self.state.glossy[self.state.prepared.hits.part_of_site[sites]]
        evenly, points = self._evenly(sites), self._points()
        for count in bounces:
            state, longest = replace(self.state, bounces=count), ALL if count is None else count
            truth = truths.picture(longest)
            off = pixel_differences(case, truth, self.seen, exits_between(state, points) + own)
            yield self._row("pixels", state, relight, off, truth.noise and float(max(truth.noise.mean)))
            if count == 0:
                continue
            exits = state.exits(self.eye).astype(float)
            halves = truths.from_sites(longest, sites, lambda n=longest: self._paths(sites, n))
            white, mean = case.scene.adopted_white(), halves.mean(axis=0)
            off = delta_e_xyz(mean + evenly, np.maximum(exits[sites] + evenly, 0.0), white)
            noise = 0.5 * delta_e_xyz(halves[0] + evenly, np.maximum(halves[1] + evenly, 0.0), white).mean()
            yield self._row("sites", state, relight, off, float(noise)) | {
                f"delta_e94_{name}": figures_of(off[which]) for name, which in (("matt", ~glossy), ("glossy", glossy))
            }

    def _paths(self, sites: Int[np.ndarray, " n"], bounces: int) -> Float[np.ndarray, "2 n 3"]:
        return paths_from(self.case, self.state.prepared, sites, self.eye, bounces)

    def _row(
        self, at: str, state: Relighting, relight: dict[str, float], off: Float[np.ndarray, " n"], noise: float | None
    ) -> dict:
        prepared = self.state.prepared
        return {
            "scene": self.case.name,
            "vertices": len(prepared.hits.sites),
            "regions": len(self.case.scene.parts),
            "method": "ours",
            "at": at,
            "rays": prepared.hits.rays,
            "coefficients": state.basis.size,
            "bounces": "all" if state.bounces is None else state.bounces,
            "precompute_cpu_seconds": self.geometry.cpu_seconds,
            "bytes": prepared.hits.nbytes,
            "relight_ms": relight,
            "light": self.case.light,
            "delta_e94": figures_of(off),
            "delta_e94_between": self._between,
            "reference_noise": noise,
        }

    @cached_property
    def _between(self) -> dict[str, float]:
        """ΔE94 of what is linear between sites beside what is traced there, wherever surfaces are, every part as a matt
        one: light that has met one surface.
        """
        hits, scene, state = self.state.prepared.hits, self.case.scene, self.state
        part = hits.part_of_site
        # XYZ of each spectrum that a part makes of a lux, and of light that a second part makes of a first one's.
        weights = [scene.observer.weights(one, NM) for one in state.spectra]
        albedo = np.stack([one.albedo for one in state.reflections])
        sent = np.concatenate([lux[:, None] * albedo[part] for lux in state.received.lux.T], axis=1)
        found = between_sites(state.prepared.scene, hits, sent)
        here = part[found.sites[:, 0]]
        straight = np.einsum("nc,nck->nk", found.shares, state.received.lux[found.sites])

        def seen(arriving: Float[np.ndarray, "n KL"]) -> Float[np.ndarray, "n 3"]:
            each = arriving.reshape(len(here), len(weights), -1) + straight[:, :, None]
            xyz = np.einsum("nkl,nl,kcl->nc", each, albedo[here], np.stack(weights), optimize=True)
            return xyz / float(scene.viewing.reference_illuminance_lux)

        return figures_of(delta_e_xyz(seen(found.traced), seen(found.mixed), scene.adopted_white()))

    def _chosen(self) -> Int[np.ndarray, " n"]:
        """Some of the sites about pixels, that look at the camera."""
        hits, there = self.state.prepared.hits, np.unique(self.seen.sites)
        centre, radius = self.state.prepared.centre_and_radius
        to = unit((self.eye - centre) / radius - hits.sites.starts[there])
        there = there[dot(to, hits.sites.normals[there]) > 0.1]
        return np.sort(np.random.default_rng(SEED).permutation(there)[:SITES])

    def _points(self) -> SurfacePoints:
        """Find what pixels show."""
        hits, seen = self.state.prepared.hits, self.seen
        found = visible_geometry(self.case.scene, None, slice(None), Tracer(self.case.scene), with_frames=True)
        assert found.frame is not None and found.geometric is not None
        there = np.searchsorted(found.pixel, seen.pixel)
        assert np.array_equal(found.pixel[there], seen.pixel)
        part = hits.part_of_site[seen.sites[:, 0]]
        return SurfacePoints(part, seen.sites, seen.shares, found.frame[there], found.wo[there], found.geometric[there])

    def _evenly(self, sites: Int[np.ndarray, " n"]) -> Float[np.ndarray, "n 3"]:
        """Compute what sites would send out of direct light, every part as a matt one."""
        scene, state = self.case.scene, self.state
        part = state.prepared.hits.part_of_site[sites]
        found = np.zeros((len(sites), 3))
        for k, spectrum in enumerate(state.spectra):
            weights = np.stack(
                [scene.observer.weights(spectrum, one.wavelengths_nm) @ one.albedo for one in state.reflections]
            )
            found += state.received.lux[sites, k, None] * weights[part]
        return found / float(scene.viewing.reference_illuminance_lux)


def paths_from(
    case: TransferScene,
    prepared: Precomputation,
    sites: Int[np.ndarray, " n"],
    eye: Float[np.ndarray, "3"],
    bounces: int,
) -> Float[np.ndarray, "2 n 3"]:
    """XYZ that sites send to an eye of light by way of other surfaces, by paths of the original scene; twice."""
    hits, (centre, radius) = prepared.hits, prepared.centre_and_radius
    frame, position = prepared.frames[sites], hits.sites.starts[sites] * radius + centre
    geometry = VisibleGeometry(
        width=len(sites),
        rows=1,
        samples=1,
        pixel=np.arange(len(sites)),
        part=hits.part_of_site[sites],
        position=position,
        wo=np.einsum("nij,nj->ni", frame, unit(eye - position)),
        lit=(),
        frame=frame,
        geometric=np.ascontiguousarray(frame[:, 2]),
    )
    surfaces = {name: Scattering(one) for name, one in case.materials.items()}
    total = BounceSum(case.scene, geometry, surfaces, (None,), Tracer(case.scene), (SEED,), PATHS, bounces)
    total.extend(PATHS)
    return total.halves[:, 0, :, 0]
