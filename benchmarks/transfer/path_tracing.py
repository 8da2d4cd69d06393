"""Mitsuba's spectral path tracer beside relighting, at an equal error: how much sooner another light is seen.

The box of saturated colours, every part matt, under an even sky of D65, so that both know exactly the same scene.
Mitsuba's noise is known by two pictures of other seeds and falls with the square root of its paths: how many it takes
until the p95 of ΔE94 is that of our whole picture, direct light and all, follows from some thousands.
"""

from __future__ import annotations

import importlib
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ...lighting.environment.environment import EnvironmentLight
from ...lighting.scene import Scene
from ...runtime.distribution import install_hint
from ...spectral.difference import delta_e_xyz
from ...spectral.illuminants import illuminant
from ..papers.site_relighting.relighting import Relighting
from ..timing import best_ms, timed
from .ours import TracedGeometry
from .pixels import ALL, Seen, figures_of, pixel_differences, truth_of
from .scenes import TransferScene, scenes

#: Name for `--case`; Mitsuba's variant; pixels along a side of a picture that is relit.
NAME, VARIANT, SIDE = "mitsuba", "llvm_ad_spectral", 512
#: Paths of a pixel in the pictures that are compared, and rays of our sites.
PATHS, RAYS = 1024, 256
_FINE_NM = np.arange(360.0, 831.0)


def path_rows(
    progress: Callable[[str], None], paths: int = PATHS, rays: int = RAYS, longest_edge: float | None = None
) -> list[dict]:
    """Our row, and Mitsuba's at our p95 with `faster`, its milliseconds beside ours for a picture of SIDE x SIDE, and
    `level`, the median of its Y beside the paths' own; none where Mitsuba is missing, which is said.
    """
    mitsuba = found_mitsuba(progress)
    if mitsuba is None:
        return []
    case = _matt_box()
    geometry = TracedGeometry.of(case, rays, case.longest_edge if longest_edge is None else longest_edge, progress)
    state = Relighting.of(case.scene, case.materials, geometry.prepared)
    truth = truth_of(case, ALL, progress)
    seen = _inner(geometry.seen, geometry.prepared.hits.part_of_site, case.scene.camera().width)
    off = pixel_differences(case, truth, seen, seen.picture(_colours(state)))
    steps = iter(range(1, 1000))
    light = state.lights[0]
    assert isinstance(light, EnvironmentLight)

    def relit() -> None:
        """Relight as many pixels as Mitsuba is counted for, of which sites and shares stay."""
        found = _colours(state.with_lights(replace(light, rotation_deg=float(next(steps)))))
        np.einsum("nk,nkc->nc", shares, found[sites])

    repeats = -(-(SIDE**2) // len(seen.pixel))
    sites, shares = (np.tile(each, (repeats, 1))[: SIDE**2] for each in (seen.sites, seen.shares))
    own = best_ms(relit)
    progress(f"{NAME}: {paths} paths of each pixel, twice")
    ours = {
        "scene": "box, matt",
        "vertices": len(geometry.prepared.hits.sites),
        "regions": len(case.scene.parts),
        "method": "ours",
        "at": "pixels",
        "rays": rays,
        "coefficients": state.basis.size,
        "bounces": "all",
        "precompute_cpu_seconds": geometry.cpu_seconds,
        "bytes": geometry.prepared.hits.nbytes,
        "relight_ms": {"light": own},
        "light": "even sky",
        "delta_e94": figures_of(off),
        "reference_noise": truth.noise and float(max(truth.noise.mean)),
    }
    matt = {name: (one.wavelengths_nm, one.diffuse) for name, one in case.materials.items()}
    halves, (seconds, _) = traced_twice(mitsuba, case.scene, matt, paths, ALL + 1)
    white = case.scene.adopted_white()
    apart = delta_e_xyz(halves[0][seen.pixel], np.maximum(halves[1][seen.pixel], 0.0), white) / np.sqrt(2.0)
    noise = figures_of(apart)
    needed = paths * (noise["p95"] / ours["delta_e94"]["p95"]) ** 2
    ms = 1000.0 * seconds / paths / halves.shape[1] * needed * SIDE**2
    level = float(np.median(halves.mean(axis=0)[seen.pixel, 1] / truth.xyz[0].reshape(-1, 3)[seen.pixel, 1]))
    scale = ours["delta_e94"]["p95"] / noise["p95"]
    theirs = ours | {
        "method": "mitsuba",
        "rays": round(needed),
        "precompute_cpu_seconds": 0.0,
        "bytes": 0,
        "relight_ms": {"light": ms},
        "delta_e94": {name: value * scale for name, value in noise.items()},
        "reference_noise": 0.0,
        "faster": ms / own,
        "level": level,
    }
    del theirs["coefficients"]
    return [ours, theirs]


def _inner(seen: Seen, part_of_site: Int[np.ndarray, " S"], width: int) -> Seen:
    """Pixels whose neighbours show the same part: Mitsuba's are means over a pixel, and noisy where two parts meet."""
    parts = np.full((width + 2, width + 2), -1)
    row, column = np.divmod(seen.pixel, width)
    parts[row + 1, column + 1] = part_of_site[seen.sites[:, 0]]
    around = [parts[row + 1 + down, column + 1 + right] for down in (-1, 0, 1) for right in (-1, 0, 1)]
    inner = (np.stack(around) == around[4]).all(axis=0)
    return Seen(seen.pixel[inner], seen.sites[inner], seen.shares[inner])


def found_mitsuba(progress: Callable[[str], None]) -> Any:
    """Return Mitsuba's module in its spectral variant; None where it is missing, which is said."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = importlib.import_module("mitsuba")
            found.set_variant(VARIANT)
    except (ImportError, AttributeError) as problem:
        progress(f"{NAME}: left out, {problem}; {install_hint('mitsuba')} has it, and it needs LLVM")
        return None
    return found


def _matt_box() -> TransferScene:
    (case,) = (one for one in scenes(full=True) if (one.name, one.light) == ("box", "sky"))
    sky = EnvironmentLight(np.ones((1, 8, 16)), (illuminant("D65"),), 1000.0, spectrum_name="D65")
    nothing = {name: np.zeros_like(one.specular) for name, one in case.materials.items()}
    materials = {name: replace(one, specular=nothing[name]) for name, one in case.materials.items()}
    return replace(case, light="even sky", scene=replace(case.scene, lights=(sky,)), materials=materials)


def _colours(state: Relighting) -> Float[np.ndarray, "S 3"]:
    """Return all that matt sites send: what lights give them, and other parts."""
    arriving = state.arriving.reshape(len(state.arriving), -1)
    part, found = state.prepared.hits.part_of_site, np.empty((len(arriving), 3))
    reference = float(state.prepared.scene.viewing.reference_illuminance_lux)
    for number, one in enumerate(state.reflections):
        mine = part == number
        weights = np.stack(
            [state.prepared.scene.observer.weights(each, one.wavelengths_nm) @ one.matt for each in state.spectra]
        )
        found[mine] = arriving[mine] @ state.matt_fold(number) + state.received.lux[mine] @ weights / reference
    return found


def traced_twice(
    mitsuba: Any, scene: Scene, matt: Mapping[str, tuple[np.ndarray, np.ndarray]], paths: int, surfaces: int
) -> tuple[Float[np.ndarray, "2 n 3"], tuple[float, float]]:
    """Trace a scene of matt materials under an even sky of D65.

    Parameters
    ----------
    matt : wavelengths, nm, and reflectances of each material. surfaces : that a path meets at most.

    Returns
    -------
    XYZ of all pixels, once a seed; seconds of one picture after its code was compiled, and of the processor.
    """
    import trimesh

    camera, power = scene.camera(), np.interp(_FINE_NM, illuminant("D65").wavelengths_nm, illuminant("D65").samples)
    cmfs = np.stack([np.interp(_FINE_NM, scene.observer.wavelengths_nm, c) for c in scene.observer.cmfs.T], axis=1)
    film = {"type": "specfilm", "width": camera.width, "height": camera.height_px, "rfilter": {"type": "box"}}
    film |= {name: _listed(cmfs[:, k]) for k, name in enumerate(("band0_x", "band1_y", "band2_z"))}
    place = mitsuba.ScalarTransform4f().look_at(
        origin=camera.position.tolist(), target=camera.target.tolist(), up=camera.up.tolist()
    )
    sensor = {"type": "perspective", "to_world": place, "fov": camera.vertical_fov_deg, "fov_axis": "y"}
    sensor |= {"near_clip": 0.01, "film": film, "sampler": {"type": "independent", "sample_count": paths}}
    world: dict[str, Any] = {"type": "scene", "sensor": sensor, "sky": {"type": "constant", "radiance": _listed(power)}}
    # Edges of a path: one more than surfaces.
    world["integrator"] = {"type": "path", "max_depth": surfaces + 1, "rr_depth": 5}
    with tempfile.TemporaryDirectory() as folder:
        for part in scene.parts:
            mesh = trimesh.Trimesh(part.mesh.vertices, part.mesh.faces, vertex_normals=part.mesh.normals, process=False)
            file = Path(folder) / f"{part.name}.ply"
            mesh.export(file, vertex_normal=True)
            colour = _listed(np.interp(_FINE_NM, *matt[part.material]))
            bsdf = {"type": "twosided", "nested": {"type": "diffuse", "reflectance": colour}}
            world[part.name] = {"type": "ply", "filename": str(file), "bsdf": bsdf}
        loaded = mitsuba.load_dict(world)

    def picture(seed: int) -> tuple[np.ndarray, tuple[float, float]]:
        before = time.process_time()
        found, seconds = timed(lambda: np.array(mitsuba.render(loaded, seed=seed), dtype=np.float64).reshape(-1, 3))
        return found, (seconds, time.process_time() - before)

    picture(1)
    (first, took), (second, again) = picture(2), picture(3)
    return np.stack([first, second]) / (power @ cmfs[:, 1]), (min(took[0], again[0]), min(took[1], again[1]))


def _listed(values: Float[np.ndarray, " L"]) -> dict[str, str]:
    """List a spectrum at every nanometre, for Mitsuba."""
    wavelengths, samples = (", ".join(f"{each:.9g}" for each in one) for one in (_FINE_NM, values))
    return {"type": "irregular", "wavelengths": wavelengths, "values": samples}
