"""Lights that spread in the reference, against closed forms and against sums over every direction."""

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.environment import latlong
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.environment.softbox import SoftboxLight
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.reference.geometry import Tracer, visible_geometry
from metamer.lighting.reference.placement import why_black
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.scene import Part, Scene, Viewing
from metamer.materials.analytic import AshikhminShirley, CookTorrance, Lambert
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.core.points import Points
from metamer.materials.svbrdf.texture import SpectralTexture
from metamer.spectral.bispectral import Bispectral
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.folding import Folding
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM as NM
from metamer.spectral.spectrum import Spectrum

OBSERVER = observer("1931_2")
D65, A = illuminant("D65"), illuminant("A")
WHITE, GREY, BLACK = (Spectrum.sampled(NM, np.full(81, value)) for value in (1.0, 0.1, 0.0))
RAMP = Spectrum.sampled(NM, np.linspace(0.1, 0.7, 81))
RNG = np.random.default_rng(5)
CLOUDS = 0.1 + RNG.random((16, 32)) ** 4
SUN = CLOUDS.copy()
SUN[4, 11] = 3e4
OBLIQUE = Camera(position=(0.6, 2.2, 4.0), target=(0.2, 0.3, 0), vertical_fov_deg=40, width=3, height_px=3, samples=2)


def metal(alpha):
    return CookTorrance(BLACK, np.linspace(0.2, 1.4, 81), np.full(81, 3.0), alpha, 1.0, "ggx", "smith")


SURFACES = {
    "white": Lambert(WHITE),
    "ramp": Lambert(RAMP),
    "black": Lambert(BLACK),
    "satin": metal(0.2),
    "mirror": metal(1e-6),
    "roughness 1": metal(1.0),
    "brushed": AshikhminShirley(RAMP, GREY, 8.0, 60.0),
    "dye": FluorescentLambert(Bispectral(NM, NM, np.diag(np.full(81, 0.2)) + np.tri(81, 81, -1) * 0.006)),
    "texture": SpectralTexture(NM, RNG.random((5, 7, 81))),
}


def environment(fields, spectra=(D65,), lux=1000.0, **more):
    return EnvironmentLight(np.reshape(fields, (len(spectra), *np.shape(fields)[-2:])), spectra, lux, **more)


def scene_of(parts, lights, camera=OBLIQUE, reference_lux=1000.0):
    return Scene(tuple(parts), tuple(lights), (camera,), OBSERVER, Viewing(reference_illuminance_lux=reference_lux))


def moved(mesh, *by):
    matrix = np.eye(4)
    matrix[:3, 3] = by
    return mesh.transformed(matrix)


def box(low, high):
    """A closed box that faces outwards, each side with corners of its own."""
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    vertices, normals, faces = [], [], []
    for axis in range(3):
        for side in (0, 1):
            normal = np.zeros(3)
            normal[axis] = 2 * side - 1
            u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
            first = len(vertices)
            for s, t in ((0, 0), (1, 0), (1, 1), (0, 1)):
                at = np.where(normal != 0, high if side else low, low) + (high - low) * (s * u + t * v)
                vertices.append(at)
                normals.append(normal)
            turn = [[0, 1, 2], [0, 2, 3]] if side else [[0, 2, 1], [0, 3, 2]]
            faces += (np.array(turn) + first).tolist()
    return Mesh(np.array(vertices), np.array(normals), np.array(faces), name="box")


def floor_and_ball(material):
    return [Part("floor", plane(6, 6), material), Part("ball", moved(sphere(4), 0.4, 1.0, 0.0), material)]


def summed(scene, surfaces, fine):
    """XYZ of a picture by a sum over all directions, each texel cut in `fine` x `fine`: no chance in it."""
    geometry, tracer = visible_geometry(scene, with_uv=scene.needs_uv(surfaces)), Tracer(scene)
    total = np.zeros((geometry.rows * geometry.width, 3))
    for light in scene.spread_lights:
        height, width = (fine * size for size in light.fields.shape[1:])
        rows, columns = np.divmod(np.arange(height * width), width)
        towards = latlong.directions((rows + 0.5) / height, (columns + 0.5) / width) @ light.world_from_map.T
        solid = np.repeat(latlong.solid_angles(height, width), width)
        folding = Folding(scene.observer, light.spectra)
        luminance = light.luminance(towards, towards)
        for sample, pixel in enumerate(geometry.pixel):
            wi = towards @ geometry.frame[sample].T
            up = np.flatnonzero((wi[:, 2] > 0) & (towards @ geometry.geometric[sample] > 0))
            some = np.broadcast_to(geometry.position[sample], (len(up), 3))
            start = tracer.lifted(some, np.broadcast_to(geometry.geometric[sample], (len(up), 3)))
            up = up[tracer.free(start, towards[up], light.distance(start, towards[up]))]
            wo = np.broadcast_to(geometry.wo[sample], (len(up), 3))
            uv = None if geometry.uv is None else np.broadcast_to(geometry.uv[sample], (len(up), 2))
            surface = surfaces[scene.parts[geometry.part[sample]].material]
            xyz = surface.xyz(Points(wi[up], wo, uv), folding).reshape(len(up), -1, 3)
            total[pixel] += np.einsum("nkc,nk,n->c", xyz, luminance[up], wi[up, 2] * solid[up])
    total *= np.pi / scene.viewing.reference_illuminance_lux / geometry.samples
    return total.reshape(geometry.rows, geometry.width, 3)


def assert_equal_within_noise(pictures, expected, white):
    off = delta_e_xyz(expected, pictures.xyz[0], white)
    lit = pictures.coverage > 0
    assert off[lit].mean() < 2.0 * pictures.noise.aimed, (off, pictures.noise.words)


@pytest.mark.slow_cases("satin", "roughness 1")
@pytest.mark.parametrize("material", ["ramp", "satin", "roughness 1", "brushed", "dye", "texture"])
def test_clouds_are_the_sum_over_all_texels(material):
    scene = scene_of(floor_and_ball(material), [environment(CLOUDS, rotation_deg=70.0)])
    if material == "texture":
        scene = scene_of([Part("floor", plane(6, 6), material), *floor_and_ball("ramp")[1:]], scene.lights)
    pictures = reference_images(scene, None, SURFACES)
    assert not pictures.noise.limited
    assert_equal_within_noise(pictures, summed(scene, SURFACES, 3), scene.adopted_white())


@pytest.mark.slow_cases("satin")
@pytest.mark.parametrize("material", ["ramp", "satin", "brushed"])
def test_a_sun_of_one_texel_is_the_sum_over_all_texels(material):
    scene = scene_of(floor_and_ball(material), [environment(SUN, lux=8000.0)], reference_lux=8000.0)
    pictures = reference_images(scene, None, SURFACES)
    assert_equal_within_noise(pictures, summed(scene, SURFACES, 8), scene.adopted_white())


def test_the_furnace_gives_a_white_lambertian_its_illuminance():
    camera = Camera(projection="orthographic", height=1.2, width=6, height_px=6, samples=2)
    light = environment(np.full((8, 16), 3.0), lux=750.0)
    scene = scene_of([Part("ball", sphere(5), "white")], [light], camera, 500.0)
    pictures = reference_images(scene, None, SURFACES, budget=0.5)
    expected = np.broadcast_to(1.5 * OBSERVER.white(D65), (6, 6, 3))
    assert delta_e_xyz(expected, pictures.xyz[0], OBSERVER.white(D65)).mean() < 2 * pictures.noise.aimed
    assert abs(pictures.xyz[0, ..., 1].mean() - 1.5) < 0.003


def test_a_light_of_one_line_has_the_colour_of_that_line():
    line = Spectrum(np.array([0.0, 1.0, 0.0]), np.array([545.0, 546.0, 547.0]), "emission")
    scene = scene_of(floor_and_ball("ramp"), [environment(CLOUDS, (line,))])
    xyz = reference_images(scene, None, SURFACES).xyz[0]
    ratio = xyz[xyz[..., 1] > 0] / xyz[xyz[..., 1] > 0][:, 1:2]
    np.testing.assert_allclose(ratio, np.broadcast_to(OBSERVER.white(line), ratio.shape), rtol=1e-9)


def test_what_is_nearly_a_mirror_shows_the_light_itself():
    camera = Camera(position=(0, 2, 3), target=(0, 0, 0), vertical_fov_deg=20, width=4, height_px=4, samples=1)
    light = environment(CLOUDS + SUN / 1e4)
    scene = scene_of([Part("floor", plane(6, 6), "mirror")], [light], camera)
    pictures = reference_images(scene, None, SURFACES, budget=0.5)
    geometry = visible_geometry(scene)
    towards = np.einsum("nji,nj->ni", geometry.frame, geometry.wo * [-1.0, -1.0, 1.0])
    surface = SURFACES["mirror"]
    cosine = geometry.wo[:, 2]
    # F of a mirror: what a smooth rough metal returns of even light, by the facets' own Fresnel term.
    from metamer.materials.analytic.cook_torrance import fresnel

    share = fresnel(cosine**2, 1.0 - cosine**2, surface.eta, surface.k) @ OBSERVER.weights(D65, NM).T
    expected = share * (np.pi / 1000.0 * light.luminance(towards, towards))
    off = delta_e_xyz(expected.reshape(4, 4, 3), pictures.xyz[0], OBSERVER.white(D65))
    assert off.max() < 0.3 and pictures.noise.mean[0] <= 0.05


def test_at_89_9_degrees_the_sum_over_all_texels_is_met():
    far, slope = 8.0, np.deg2rad(0.1)
    camera = Camera(
        position=(0, far * np.sin(slope), far * np.cos(slope)),
        target=(0, 0, 0), projection="orthographic", height=1e-3, width=2, height_px=2, samples=1,
    )  # fmt: skip
    for material in ("ramp", "roughness 1"):
        scene = scene_of([Part("floor", plane(6, 6), material)], [environment(CLOUDS)], camera)
        pictures = reference_images(scene, None, SURFACES, budget=0.5)
        assert pictures.coverage.min() == 1 and np.isfinite(pictures.xyz).all()
        assert_equal_within_noise(pictures, summed(scene, SURFACES, 4), scene.adopted_white())


def test_a_black_surface_is_exactly_black_and_without_noise():
    scene = scene_of(floor_and_ball("black"), [environment(SUN)])
    pictures = reference_images(scene, None, SURFACES)
    assert (pictures.xyz == 0).all()
    assert pictures.noise.mean == (0.0,) and pictures.noise.p99 == (0.0,) and not pictures.noise.limited


def test_no_light_leaks_into_a_closed_room_where_walls_meet_or_run_through_each_other():
    inside = Camera(
        position=(0.3, 0.2, 0.4), target=(-1, -1, -1), vertical_fov_deg=100, width=24, height_px=24, samples=2
    )
    apart = [
        Part("room", box((-1, -1, -1), (1, 1, 1)), "white"),
        Part("ball", moved(sphere(3, 0.5), -0.5, -0.9, -0.4), "satin"),
    ]
    scene = scene_of(apart, [environment(SUN)], inside)
    assert (reference_images(scene, None, SURFACES, most_directions=64).xyz == 0).all()
    through = [
        Part("low", box((-1, -1, -1), (1, 0.5, 1)), "white"),
        Part("high", box((-0.9, -0.5, -0.9), (0.9, 1, 0.9)), "white"),
    ]
    scene = scene_of(through, [environment(SUN)], inside)
    assert (reference_images(scene, None, SURFACES, most_directions=64).xyz == 0).all()


def test_an_open_sheet_is_lit_from_the_side_that_is_seen():
    light = environment(np.vstack([np.full((8, 32), 1.0), np.zeros((8, 32))]))
    for height, lit in ((2.0, True), (-2.0, False)):
        camera = Camera(position=(0.1, height, 0.2), target=(0, 0, 0), vertical_fov_deg=20, width=3, height_px=3)
        xyz = reference_images(scene_of([Part("sheet", plane(4, 4), "white")], [light], camera), None, SURFACES).xyz[0]
        # Between the last bright row of texels and the first dark one, the light reaches a little below the horizon.
        assert (xyz[..., 1] > 0.9).all() if lit else (xyz[..., 1] < 0.02).all()


def test_where_a_ball_stands_on_a_floor_no_light_leaks_under_it():
    """Under an even sky and a black ball, the floor keeps 1 - (1 + (d/r)^2)^(-3/2), at d from the contact."""
    camera = Camera(
        position=(0, 0.1, 1.2), target=(0, 0, 0.1), projection="orthographic", height=0.02,
        width=4, height_px=16, samples=1,
    )  # fmt: skip
    parts = [Part("floor", plane(8, 8), "white"), Part("ball", moved(sphere(6, 0.5), 0, 0.5, 0), "black")]
    scene = scene_of(parts, [environment(np.ones((8, 16)))], camera)
    geometry = visible_geometry(scene)
    xyz = reference_images(scene, None, SURFACES, budget=0.5, geometry=geometry).xyz[0, ..., 1]
    floor = geometry.part == 0
    distance = np.hypot(*geometry.position[floor][:, [0, 2]].T)
    assert distance.min() < 0.03 < 0.15 < distance.max()
    expected = 1.0 - (1.0 + (distance / 0.5) ** 2) ** -1.5
    np.testing.assert_allclose(xyz.ravel()[geometry.pixel[floor]], expected, atol=0.002, rtol=0.03)


def test_a_softbox_gives_what_it_is_said_to_give_and_adds_to_a_sky():
    camera = Camera(position=(0, 2, 0.01), target=(0, 0, 0), vertical_fov_deg=0.5, width=2, height_px=2, samples=1)
    box_light = SoftboxLight((0.8, 3, 0), (0, 0, 0), 1.0, 0.6, A, 600.0)
    facing = 3 / np.hypot(0.8, 3)
    found = []
    for lights in ([box_light], [environment(np.ones((2, 4)))], [box_light, environment(np.ones((2, 4)))]):
        found.append(reference_images(scene_of([Part("floor", plane(6, 6), "white")], lights, camera), None, SURFACES))
    np.testing.assert_allclose(found[0].xyz[0, ..., 1], 0.6 * facing, rtol=0.01)
    np.testing.assert_allclose(found[2].xyz[0], found[0].xyz[0] + found[1].xyz[0], rtol=0.01)


def test_a_picture_that_a_sky_lights_is_not_called_black_and_a_closed_room_is():
    assert why_black(scene_of(floor_and_ball("ramp"), [environment(SUN)])) == ()
    inside = Camera(position=(0.3, 0.2, 0.4), target=(-1, -1, -1), vertical_fov_deg=100, width=24, height_px=24)
    room = scene_of([Part("room", box((-1, -1, -1), (1, 1, 1)), "white")], [environment(SUN)], inside)
    (line,) = why_black(room)
    assert "is black" in line
