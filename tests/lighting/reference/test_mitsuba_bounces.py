"""Mitsuba 3's path tracer must agree with the reference within the noise of both, however often light is passed on.

Films, XYZ and noise are as in `test_mitsuba`. Mitsuba counts edges of a path: depth 2 is direct light, 3 is one surface
in between. Its diffuse surfaces have one side; those of our scenes are seen from that side only.
"""

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.lights import PointLight
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import sphere
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.scene import Part, Scene
from metamer.materials.analytic import CookTorrance, Lambert
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM as NM
from metamer.spectral.spectrum import Spectrum

pytestmark = pytest.mark.mitsuba

PIXELS, BLOCK, COUNT = 24, 8, 256
# Share of white allowed to the 5 nm grid and our regular sample points at outlines.
ALLOWANCE = 0.001
FINE_NM = np.arange(360.0, 831.0)
RED = np.interp(NM, [380, 560, 620, 780], [0.05, 0.08, 0.7, 0.75])
BLUE = np.interp(NM, [380, 480, 560], [0.6, 0.65, 0.1])
GREY = np.full(81, 0.6)
GOLD_N = np.interp(NM, [400, 500, 600, 800], [1.46, 1.0, 0.25, 0.16])
GOLD_K = np.interp(NM, [400, 500, 800], [2.0, 1.8, 5.0])
BLACK = Spectrum.sampled(NM, np.zeros(81))
LAMP = (0.2, 1.6, 0.3)


def spectrum(values, wavelengths_nm=NM):
    listed = ", ".join(f"{value:.9g}" for value in np.interp(FINE_NM, wavelengths_nm, values))
    return {"type": "irregular", "wavelengths": ", ".join(f"{nm:g}" for nm in FINE_NM), "values": listed}


def rectangle(*corners):
    """Four corners, counter-clockwise as seen from its front."""
    vertices = np.array(corners, dtype=float)
    normal = np.cross(vertices[1] - vertices[0], vertices[2] - vertices[0])
    return Mesh(vertices, np.tile(normal / np.linalg.norm(normal), (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]))


def room():
    """Five sides of a box, open towards +z."""
    a, b, c, d = (-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)
    e, f, g, h = (-1, 2, 1), (1, 2, 1), (1, 2, -1), (-1, 2, -1)
    sides = {"floor": (a, b, c, d), "ceiling": (h, g, f, e), "back": (d, c, g, h), "left": (a, d, h, e)}
    return {name: rectangle(*corners) for name, corners in (sides | {"right": (c, b, f, g)}).items()}


def pictures_of(mi, scene, bsdfs, folder, depth):
    """XYZ (2, H, W, 3) by Mitsuba, one a seed."""
    import trimesh

    camera, light = scene.camera(), scene.lights[0]
    cmfs = np.stack([np.interp(FINE_NM, scene.observer.wavelengths_nm, c) for c in scene.observer.cmfs.T], axis=1)
    power = np.interp(FINE_NM, light.spectrum.wavelengths_nm, light.spectrum.samples)
    film = {"type": "specfilm", "width": PIXELS, "height": PIXELS, "rfilter": {"type": "box"}}
    film |= {name: spectrum(cmfs[:, k], FINE_NM) for k, name in enumerate(("band0_x", "band1_y", "band2_z"))}
    place = mi.ScalarTransform4f().look_at(
        origin=camera.position.tolist(), target=camera.target.tolist(), up=camera.up.tolist()
    )
    sensor = {"type": "perspective", "to_world": place, "fov": camera.vertical_fov_deg, "fov_axis": "y"}
    sensor |= {"near_clip": 0.01, "film": film, "sampler": {"type": "independent", "sample_count": COUNT}}
    lamp = {"type": "point", "position": light.position.tolist(), "intensity": spectrum(power, FINE_NM)}
    world = {"type": "scene", "integrator": {"type": "path", "max_depth": depth, "rr_depth": 100}}
    world |= {"sensor": sensor, "light": lamp}
    for part in scene.parts:
        mesh = trimesh.Trimesh(part.mesh.vertices, part.mesh.faces, vertex_normals=part.mesh.normals, process=False)
        mesh.export(folder / f"{part.name}.ply", vertex_normal=True)
        world[part.name] = {"type": "ply", "filename": str(folder / f"{part.name}.ply"), "bsdf": bsdfs[part.material]}
    loaded = mi.load_dict(world)
    scale = np.pi / (power @ cmfs[:, 1]) * light.intensity_cd / scene.viewing.reference_illuminance_lux
    return np.stack([np.array(mi.render(loaded, seed=seed), dtype=np.float64) * scale for seed in (1, 2)])


def blocks(image):
    """(b, 64, 3): the pixels of each 8 x 8 block."""
    split = image.reshape(PIXELS // BLOCK, BLOCK, PIXELS // BLOCK, BLOCK, 3)
    return split.transpose(0, 2, 1, 3, 4).reshape(-1, BLOCK * BLOCK, 3)


@pytest.mark.parametrize(("depth", "ball"), [(2, "blue"), (3, "blue"), (6, "blue"), (4, "gold")])
def test_light_passed_on(mi, tmp_path, record_property, depth, ball):
    surfaces = {"red": RED, "grey": GREY, "blue": BLUE}
    bsdfs = {name: {"type": "diffuse", "reflectance": spectrum(values)} for name, values in surfaces.items()}
    bsdfs["gold"] = {"type": "roughconductor", "distribution": "ggx", "alpha": 0.4, "eta": spectrum(GOLD_N)}
    bsdfs["gold"] |= {"k": spectrum(GOLD_K)}
    ours = {name: Lambert(Spectrum.sampled(NM, values)) for name, values in surfaces.items()}
    ours["gold"] = CookTorrance(BLACK, GOLD_N, GOLD_K, 0.4, 1.0, "ggx", "smith")
    wearing = {"left": "red", "right": "blue"}
    parts = [Part(name, mesh, wearing.get(name, "grey")) for name, mesh in room().items()]
    body = sphere(4, 0.45)
    parts.append(Part("ball", Mesh(body.vertices + np.array([0.1, 0.5, 0.0]), body.normals, body.faces), ball))
    camera = Camera(
        position=(0, 1, 3.2), target=(0, 0.95, 0), vertical_fov_deg=42, width=PIXELS, height_px=PIXELS, samples=4
    )
    light = PointLight(LAMP, illuminant("FL11"), 1500.0)
    scene = Scene(tuple(parts), (light,), (camera,), observer("1931_2"))
    pictures = reference_images(scene, None, ours, budget=5.0, bounces=depth - 2, most_directions=1024)
    theirs = pictures_of(mi, scene, bsdfs, tmp_path, depth)
    xyz, noise_words = pictures.xyz[0], "none" if pictures.noise is None else pictures.noise.words
    apart = blocks(xyz - theirs.mean(axis=0)).mean(axis=1)
    noise = np.sqrt(blocks((theirs[0] - theirs[1]) ** 2).mean(axis=1) / 4.0) / BLOCK
    level = blocks(xyz).mean(axis=(0, 1))
    record_property("whole picture, relative difference", (apart.mean(axis=0) / level).tolist())
    record_property("our noise", noise_words)
    print(apart.mean(axis=0) / level, np.abs(apart).max(), noise.max(), level, noise_words)
    # A pixel of ours is off by about 0.3 % of its XYZ for a ΔE of 0.1, and a block has 64 of them.
    stated = 0.0 if pictures.noise is None else pictures.noise.mean[0]
    own = 4.0 * 0.03 * stated * blocks(xyz).mean(axis=1) / BLOCK
    assert (np.abs(apart) < 4.0 * noise + own + ALLOWANCE).all(), (np.abs(apart) - 4.0 * noise).max()
    # All blocks together are known better than each.
    known = 4.0 * np.sqrt((noise**2).mean(axis=0) / len(noise)) / level
    assert (np.abs(apart.mean(axis=0) / level) < known + 2.0 * ALLOWANCE).all()
