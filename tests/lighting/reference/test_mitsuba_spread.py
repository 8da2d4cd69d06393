"""Mitsuba 3 under lights that spread: it must agree with the reference within the noise of both, at every wavelength.

Films, XYZ and noise are as in `test_mitsuba`. A light that is even over all directions is Mitsuba's `constant` emitter,
which takes any spectrum. Of a map its `envmap` knows RGB only: equal RGB are its D65 times a number, so that the map is
of one spectrum, which our side gets from Mitsuba. Its columns lie as ours do; its first and last rows lie at the poles
themselves, so that it gets 2 H + 1 rows of ours, between whose middles both are linear: the two are the same function
of direction. Only direct light is traced, both by the light and by the surface.
"""

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.mesh.shapes import plane, speed_shape, sphere
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.scene import Part, Scene
from metamer.materials.analytic import CookTorrance, Lambert
from metamer.materials.svbrdf.texture import SpectralTexture
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM as NM
from metamer.spectral.spectrum import Spectrum

pytestmark = pytest.mark.mitsuba

PIXELS, BLOCK, COUNT = 32, 8, 144
# Share of white allowed to our regular sample points at outlines and the 5 nm grid.
ALLOWANCE = 0.001
FINE_NM = np.arange(360.0, 831.0)
RED, BLUE = np.interp(NM, [380, 560, 620, 780], [0.05, 0.08, 0.6, 0.7]), np.interp(NM, [380, 480, 560], [0.5, 0.6, 0.1])
GOLD_N, GOLD_K = (
    np.interp(NM, [400, 500, 600, 800], [1.46, 1.0, 0.25, 0.16]),
    np.interp(NM, [400, 500, 800], [2, 1.8, 5]),
)
BLACK = Spectrum.sampled(NM, np.zeros(81))


def spectrum(values, wavelengths_nm=NM):
    """A Mitsuba spectrum, linear between samples and held beyond."""
    listed = ", ".join(f"{value:.9g}" for value in np.interp(FINE_NM, wavelengths_nm, values))
    return {"type": "irregular", "wavelengths": ", ".join(f"{nm:g}" for nm in FINE_NM), "values": listed}


def written(mesh, path):
    """The mesh as PLY with normals and texture coordinates."""
    rows = np.hstack([mesh.vertices, mesh.normals, mesh.uv])
    head = ["ply", "format ascii 1.0", f"element vertex {len(rows)}"]
    head += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz", "u", "v")]
    head += [f"element face {len(mesh.faces)}", "property list uchar int vertex_indices", "end_header"]
    lines = [" ".join(f"{value:.9g}" for value in row) for row in rows]
    lines += ["3 " + " ".join(map(str, face)) for face in mesh.faces]
    path.write_text("\n".join([*head, *lines, ""]))
    return {"type": "ply", "filename": str(path)}


def constant(mi, power):
    """Our light and Mitsuba's, even over all directions."""
    light = EnvironmentLight(np.ones((1, 2, 4)), (Spectrum(power, FINE_NM, "emission"),), 1000.0)
    return light, {"type": "constant", "radiance": spectrum(power, FINE_NM)}, light.fields[0, 0, 0]


def mapped(mi, field):
    """The same of a map."""
    height = len(field)
    d65 = mi.load_dict({"type": "d65"})
    power = []
    for nm in FINE_NM:
        at = mi.SurfaceInteraction3f()
        at.wavelengths = [nm] * 4
        power.append(d65.eval(at)[0])
    rows = np.clip(np.arange(2 * height + 1) / 2 - 0.5, 0, height - 1)
    above = np.minimum(rows.astype(int), height - 2)
    finer = field[above] + (rows - above)[:, None] * (field[above + 1] - field[above])
    rgb = mi.Bitmap(np.repeat(finer[..., None], 3, axis=2).astype(np.float32))
    light = EnvironmentLight(field[None], (Spectrum(np.array(power), FINE_NM, "emission"),), 1000.0)
    return light, {"type": "envmap", "bitmap": rgb}, light.fields[0, 0, 0] / field[0, 0]


def by_mitsuba(mi, scene, emitter, luminance, bsdfs, folder):
    """XYZ (2, H, W, 3), one a seed; `luminance`: cd/m^2 of ours for 1 of Mitsuba's."""
    camera, light = scene.camera(), scene.spread_lights[0]
    cmfs = np.stack([np.interp(FINE_NM, scene.observer.wavelengths_nm, c) for c in scene.observer.cmfs.T], axis=1)
    film = {"type": "specfilm", "width": camera.width, "height": camera.height_px, "rfilter": {"type": "box"}}
    film |= {name: spectrum(cmfs[:, k], FINE_NM) for k, name in enumerate(("band0_x", "band1_y", "band2_z"))}
    place = mi.ScalarTransform4f().look_at(
        origin=camera.position.tolist(), target=camera.target.tolist(), up=camera.up.tolist()
    )
    sensor = {"type": "perspective", "to_world": place, "fov": camera.vertical_fov_deg, "fov_axis": "y"}
    sensor |= {"near_clip": 0.01, "far_clip": 1000.0, "film": film}
    world = {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 1, "hide_emitters": True},
        "sensor": sensor | {"sampler": {"type": "independent", "sample_count": COUNT}},
        "light": emitter,
    }
    for part in scene.parts:
        world[part.name] = written(part.mesh, folder / f"{part.name}.ply") | {"bsdf": bsdfs[part.material]}
    loaded = mi.load_dict(world)
    scale = np.pi / scene.viewing.reference_illuminance_lux * luminance / (light.spectra[0].samples @ cmfs[:, 1])
    return np.stack([np.array(mi.render(loaded, seed=seed), dtype=np.float64)[..., :3] * scale for seed in (1, 2)])


def blocks(image):
    """(b, 64, 3): the pixels of each 8 x 8 block."""
    split = image.reshape(PIXELS // BLOCK, BLOCK, PIXELS // BLOCK, BLOCK, 3)
    return split.transpose(0, 2, 1, 3, 4).reshape(-1, BLOCK * BLOCK, 3)


def assert_agrees(mi, folder, record, parts, light, surfaces, bsdfs):
    ours_light, emitter, luminance = light
    camera = Camera(
        position=(0.6, 1.6, 4.5), target=(0, 0.3, 0), vertical_fov_deg=36, width=PIXELS, height_px=PIXELS, samples=6
    )
    scene = Scene(parts, (ours_light,), (camera,), observer("1931_2"))
    pictures = reference_images(scene, None, surfaces, budget=1.5)
    theirs = by_mitsuba(mi, scene, emitter, luminance, bsdfs, folder)
    ours = pictures.xyz[0]
    apart = blocks(ours - theirs.mean(axis=0)).mean(axis=1)
    noise = np.sqrt(blocks((theirs[0] - theirs[1]) ** 2).mean(axis=1) / 4.0) / BLOCK
    whole = apart.mean(axis=0) / blocks(ours).mean(axis=(0, 1))
    record("mean XYZ, of ours and Mitsuba's", (ours.mean(axis=(0, 1)).tolist(), theirs.mean(axis=(0, 1, 2)).tolist()))
    record("whole picture, relative difference", whole.tolist())
    record("our noise", pictures.noise.words)
    print(whole, np.abs(apart).max(), noise.max(), pictures.noise.words)
    # A pixel of ours is off by about 0.3 % of its XYZ for a ΔE of 0.1, and a block has 64 of them.
    own = 4.0 * 0.03 * pictures.noise.mean[0] * blocks(ours).mean(axis=1) / BLOCK
    assert (np.abs(apart) < 4.0 * noise + own + ALLOWANCE).all(), (np.abs(apart) - 4.0 * noise).max()
    # All blocks together are known better than each.
    known = 4.0 * np.sqrt((noise**2).mean(axis=0) / len(noise)) / blocks(ours).mean(axis=(0, 1))
    assert (np.abs(whole) < known + ALLOWANCE).all(), (whole, known)


def floor():
    matrix = np.eye(4)
    matrix[1, 3] = -1.0
    return plane(8, 8).transformed(matrix)


def test_a_gold_body_on_a_painted_floor_under_even_light_of_fl11(mi, tmp_path, record_property):
    power = np.interp(FINE_NM, illuminant("FL11").wavelengths_nm, illuminant("FL11").samples, left=0, right=0)
    surfaces = {
        "gold": CookTorrance(BLACK, GOLD_N, GOLD_K, 0.3, 1.0, "ggx", "smith"),
        "red": Lambert(Spectrum.sampled(NM, RED)),
    }
    gold = {"type": "roughconductor", "distribution": "ggx", "alpha": 0.3}
    bsdfs = {"gold": gold | {"eta": spectrum(GOLD_N), "k": spectrum(GOLD_K)}, "red": {"type": "diffuse"}}
    bsdfs["red"]["reflectance"] = spectrum(RED)
    parts = (Part("body", speed_shape(5, uv=True), "gold"), Part("floor", plane(8, 8), "red"))
    assert_agrees(mi, tmp_path, record_property, parts, constant(mi, power), surfaces, bsdfs)


def clouds():
    field = 0.2 + np.random.default_rng(3).random((6, 12)) ** 2
    field[1, 4] = 40.0
    return field


def test_a_glossy_ball_under_clouds_and_a_sun(mi, tmp_path, record_property):
    surfaces = {
        "gold": CookTorrance(BLACK, GOLD_N, GOLD_K, 0.15, 1.0, "ggx", "smith"),
        "blue": Lambert(Spectrum.sampled(NM, BLUE)),
    }
    gold = {"type": "roughconductor", "distribution": "ggx", "alpha": 0.15}
    bsdfs = {"gold": gold | {"eta": spectrum(GOLD_N), "k": spectrum(GOLD_K)}, "blue": {"type": "diffuse"}}
    bsdfs["blue"]["reflectance"] = spectrum(BLUE)
    parts = (Part("ball", sphere(5, uv=True), "gold"), Part("floor", floor(), "blue"))
    assert_agrees(mi, tmp_path, record_property, parts, mapped(mi, clouds()), surfaces, bsdfs)


def test_a_map_of_two_paints_on_a_ball_with_texture_coordinates(mi, tmp_path, record_property):
    share = np.random.default_rng(4).random((8, 16)).astype(np.float32)
    texture = SpectralTexture(NM, (1.0 - share[..., None]) * RED + share[..., None] * BLUE)
    paint = {
        "type": "blendbsdf",
        # Its rows count from below.
        "weight": {
            "type": "bitmap",
            "bitmap": mi.Bitmap(np.ascontiguousarray(share[::-1, :, None])),
            "raw": True,
            "filter_type": "bilinear",
        },
        "first": {"type": "diffuse", "reflectance": spectrum(RED)},
        "second": {"type": "diffuse", "reflectance": spectrum(BLUE)},
    }
    parts = (Part("ball", sphere(5, uv=True), "map"), Part("floor", floor(), "blue"))
    surfaces = {"map": texture, "blue": Lambert(Spectrum.sampled(NM, BLUE))}
    bsdfs = {"map": paint, "blue": {"type": "diffuse", "reflectance": spectrum(BLUE)}}
    assert_agrees(mi, tmp_path, record_property, parts, mapped(mi, clouds()), surfaces, bsdfs)
