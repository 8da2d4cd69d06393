"""The reference against closed forms, and the geometry that it rests on."""

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.lights import DirectionalLight, PointLight
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import cloth, plane, speed_shape, sphere
from metamer.lighting.reference.geometry import Tracer, visible_geometry
from metamer.lighting.reference.reference import reference_image, reference_images
from metamer.lighting.scene import Part, Scene, Viewing
from metamer.lighting.vectors import LEAST_COSINE
from metamer.materials.analytic import AshikhminShirley, Lambert
from metamer.runtime.errors import UnknownNameError
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum

OBSERVER = observer("1931_2")
D65 = illuminant("D65")
RAMP = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.linspace(0.1, 0.7, 81))
WHITE = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.ones(81))
BRDFS = {"ramp": Lambert(RAMP), "white": Lambert(WHITE)}
FROM_ABOVE = Camera(
    position=(0, 6, 0), target=(0, 0, 0), up=(0, 0, -1), projection="orthographic", height=4, width=32, height_px=32
)


def scene_of(parts, lights, camera, reference_lux=1000.0):
    return Scene(tuple(parts), tuple(lights), (camera,), OBSERVER, Viewing(reference_illuminance_lux=reference_lux))


def test_a_lambert_sphere_is_the_cosine():
    camera = Camera(projection="orthographic", height=2.2, width=64, height_px=64, samples=1)
    light = DirectionalLight((0.4, 0.5, 0.8), D65, 600)
    xyz, coverage = reference_image(scene_of([Part("ball", sphere(), "ramp")], [light], camera), None, BRDFS)
    origins, _ = camera.rays()
    x, y = origins[..., 0], origins[..., 1]
    inside = np.hypot(x, y) < 0.999
    normal = np.stack([x, y, np.sqrt(np.where(inside, 1 - x * x - y * y, 0))], axis=-1)
    cosine = normal @ light.direction_to_light
    expected = np.maximum(cosine, 0)[..., None] * 0.6 * (OBSERVER.weights(D65, WORKING_WAVELENGTHS_NM) @ RAMP.samples)
    assert (coverage[inside] == 1).all()
    assert (coverage[np.hypot(x, y) > 1] == 0).all()
    # Near the terminator the flat triangles' own horizon cuts the light off, by up to half an edge: 0.01.
    sure = inside & (np.abs(cosine) > 0.012)
    np.testing.assert_allclose(xyz[sure], expected[sure], atol=2e-4)


def test_a_perfect_diffuser_facing_the_light_has_y_1_and_the_lights_white():
    camera = FROM_ABOVE
    scene = scene_of([Part("floor", plane(), "white")], [DirectionalLight((0, 1, 0), D65, 1000)], camera)
    for name in ("D65", "A", "FL11"):
        xyz, _ = reference_image(scene, None, BRDFS, illuminant(name))
        np.testing.assert_allclose(xyz, np.broadcast_to(OBSERVER.white(illuminant(name)), xyz.shape), atol=1e-6)


def test_light_from_all_directions_makes_a_white_floor_one():
    """Furnace: unit radiance from n directions of equal solid angle; each is a light of illuminance 2 pi / n."""
    n = 200
    k = np.arange(n) + 0.5
    height, turn = k / n, np.pi * (1 + 5**0.5) * k
    radius = np.sqrt(1 - height**2)
    directions = np.stack([radius * np.cos(turn), height, radius * np.sin(turn)], axis=1)
    lights = [DirectionalLight(d, D65, 2 * np.pi / n) for d in directions]
    camera = Camera(position=(0, 6, 0), up=(0, 0, -1), projection="orthographic", height=1, width=2, height_px=2)
    xyz, _ = reference_image(scene_of([Part("floor", plane(), "white")], lights, camera, np.pi), None, BRDFS)
    np.testing.assert_allclose(xyz[..., 1], 1, rtol=1e-5)


def test_a_point_light_over_a_floor_falls_with_distance_squared_and_cosine():
    light = PointLight((0, 1.5, 0), D65, 1000)
    camera = FROM_ABOVE
    xyz, _ = reference_image(scene_of([Part("floor", plane(), "white")], [light], camera), None, BRDFS)
    origins, _ = camera.rays()
    squared = origins[..., 0] ** 2 + origins[..., 2] ** 2 + 1.5**2
    expected = 1.5 / squared**1.5
    expected = expected.reshape(32, 3, 32, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(xyz[..., 1], expected, rtol=1e-9)


@pytest.mark.parametrize("kind", ["directional", "point"])
def test_the_shadow_of_a_disc_lies_where_geometry_says(kind):
    """A disc of radius 0.4 at height 1 over a floor, of which a grid of points looks at the light."""
    turn = np.linspace(0, 2 * np.pi, 257)[:-1]
    rim = np.stack([0.4 * np.cos(turn), np.ones(256), -0.4 * np.sin(turn)], axis=1)
    vertices = np.concatenate([[[0.0, 1, 0]], rim])
    faces = np.array([[0, k + 1, (k + 1) % 256 + 1] for k in range(256)])
    disc = Mesh(vertices, np.tile([0.0, 1, 0], (257, 1)), faces)
    # Directional: the shadow is the disc moved by (-0.75, 0); from a point at height 3 it is 1.5 times as wide.
    if kind == "directional":
        light, centre, radius = DirectionalLight((0.75, 1, 0), D65, 1000), (-0.75, 0.0), 0.4
    else:
        light, centre, radius = PointLight((0.8, 3, 0), D65, 9000), (-0.4, 0.0), 0.6
    scene = scene_of([Part("floor", plane(6, 6), "white"), Part("disc", disc, "white")], [light], FROM_ABOVE)
    tracer = Tracer(scene)
    x, z = (axis.reshape(-1) for axis in np.meshgrid(np.linspace(-1.5, 1.5, 121), np.linspace(-1.5, 1.5, 121)))
    points = np.stack([x, 0 * x, z], axis=1)
    normals = np.tile([0.0, 1, 0], (len(x), 1))
    free = tracer.reaches(light, points, normals)
    distance = np.hypot(x - centre[0], z - centre[1])
    clear = np.abs(distance - radius) > 0.002
    np.testing.assert_array_equal(free[clear], (distance > radius)[clear])
    assert (~free).sum() > 300


def test_what_lies_behind_a_point_light_casts_no_shadow():
    parts = [Part("floor", plane(6, 6), "white"), Part("ceiling", plane(6, 6).transformed(shift(0, 2, 0)), "white")]
    camera = Camera(position=(0, 1.5, 2.9), target=(0, 0, 1), width=8, height_px=8)
    xyz, coverage = reference_image(scene_of(parts, [PointLight((0, 1, 0), D65, 1000)], camera), None, BRDFS)
    assert (coverage == 1).all()
    assert (xyz[..., 1] > 0).all()


def test_a_sphere_lights_none_of_its_far_side():
    camera = Camera(projection="orthographic", height=2.2, width=32, height_px=32)
    scene = scene_of([Part("ball", sphere(5), "white")], [DirectionalLight((0, 0, -1), D65, 1000)], camera)
    xyz, coverage = reference_image(scene, None, BRDFS)
    # Only the last sample points of the outline may see over the edge, at grazing light.
    assert coverage.max() == 1
    assert xyz.max() < 1e-3


def test_both_sides_of_a_cloth_scatter():
    light = DirectionalLight((0.3, -1, 0.2), D65, 1000)
    camera = Camera(position=(0.2, -5, 1.5), target=(0, 0.4, 0), width=32, height_px=32, vertical_fov_deg=20)
    geometry = visible_geometry(scene_of([Part("cloth", cloth(60), "white")], [light], camera))
    assert (geometry.wo[:, 2] >= LEAST_COSINE * 0.99).all()
    assert len(geometry.lit[0].sample) > 0.5 * len(geometry.pixel)
    assert (geometry.lit[0].wi[:, 2] > 0).all()


def test_local_directions_are_unit_and_keep_their_angle():
    light = DirectionalLight((0.4, 0.9, 0.3), D65, 1000)
    camera = Camera(position=(1, 2, 5), target=(0, 0.4, 0), width=24, height_px=24)
    geometry = visible_geometry(scene_of([Part("body", speed_shape(5), "white")], [light], camera))
    lit = geometry.lit[0]
    wo = geometry.wo[lit.sample]
    np.testing.assert_allclose(np.linalg.norm(geometry.wo, axis=1), 1, atol=1e-12)
    world = camera.to_viewer(geometry.position[lit.sample]) @ light.direction_to_light
    np.testing.assert_allclose(np.einsum("ij,ij->i", wo, lit.wi), world, atol=1e-12)


def test_anisotropy_follows_the_stated_tangent():
    """On a sphere without uv the tangent is horizontal: turning the whole scene about y changes nothing."""
    brdf = AshikhminShirley(RAMP, Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(81, 0.3)), 400.0, 10.0)
    pictures = []
    for angle in (0.0, 0.9):
        turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
        camera = Camera(position=turn @ [0, 1, 4], width=24, height_px=24, vertical_fov_deg=32)
        light = DirectionalLight(turn @ [0.3, 0.8, 1], D65, 1000)
        pictures.append(reference_image(scene_of([Part("b", sphere(), "m")], [light], camera), None, {"m": brdf})[0])
    assert np.abs(pictures[0] - pictures[1]).max() < 0.02 * pictures[0].max()
    assert pictures[0][12, 12, 1] > 0


def shift(x, y, z):
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


@pytest.fixture(scope="module")
def busy():
    camera = Camera(position=(0.5, 2, 5), target=(0, 0.4, 0), width=30, height_px=22, samples=2)
    lights = [DirectionalLight((-0.5, 0.9, 0.4), D65, 700), PointLight((2, 2, 2), illuminant("A"), 1500)]
    return scene_of([Part("body", speed_shape(5), "ramp"), Part("floor", plane(), "white")], lights, camera)


def test_bands_and_blocks_change_nothing(busy):
    whole = reference_images(busy, None, BRDFS)
    small = reference_images(busy, None, BRDFS, band_samples=400, block=37)
    reused = reference_images(busy, None, BRDFS, geometry=visible_geometry(busy))
    # Sums run in another order: equal to rounding.
    np.testing.assert_allclose(small.xyz, whole.xyz, rtol=1e-12, atol=1e-15)
    np.testing.assert_array_equal(small.coverage, whole.coverage)
    np.testing.assert_array_equal(reused.xyz, whole.xyz)


def test_several_illuminants_at_once_are_each_alone(busy):
    together = reference_images(busy, None, BRDFS, (None, illuminant("FL11"), illuminant("A")))
    own, _ = reference_image(busy, None, BRDFS)
    fl11, _ = reference_image(busy.with_illuminant(illuminant("FL11")), None, BRDFS)
    np.testing.assert_allclose(together.xyz[0], own, rtol=1e-12)
    np.testing.assert_allclose(together.xyz[1], fl11, rtol=1e-12)
    assert not np.allclose(together.xyz[0], together.xyz[2])


def test_geometry_serves_every_material(busy):
    geometry = visible_geometry(busy)
    other = busy.with_material("body", "white")
    np.testing.assert_array_equal(
        reference_images(other, None, BRDFS, geometry=geometry).xyz, reference_images(other, None, BRDFS).xyz
    )


def test_a_far_camera_far_from_the_origin_sees_the_same():
    """Embree works in float32: 10 km away and 10 km off the origin must not show."""
    move = np.array([1e4, -2e4, 3e4])
    pictures = []
    for offset, distance in ((np.zeros(3), 4.0), (move, 1e4)):
        camera = Camera(
            position=offset + np.array([0, 0, distance]),
            target=offset,
            projection="orthographic",
            height=2.2,
            width=48,
            height_px=48,
        )
        ball = sphere(5).transformed(shift(*offset))
        light = DirectionalLight((0.4, 0.5, 0.8), D65, 1000)
        pictures.append(reference_image(scene_of([Part("ball", ball, "ramp")], [light], camera), None, BRDFS))
    (near, near_coverage), (far, far_coverage) = pictures
    assert np.abs(near_coverage - far_coverage).sum() < 2
    same = near_coverage == far_coverage
    np.testing.assert_allclose(far[same], near[same], atol=1e-3)


def test_no_ray_slips_through_a_closed_surface_even_at_its_vertices():
    ball = sphere()
    tracer = Tracer(scene_of([Part("ball", ball, "white")], [DirectionalLight((0, 0, 1), D65, 1000)], FROM_ABOVE))
    aimed = np.concatenate([ball.vertices, ball.vertices[ball.faces[:, :2]].mean(axis=1)])
    aimed /= np.linalg.norm(aimed, axis=1, keepdims=True)
    assert (tracer.first(np.zeros_like(aimed), aimed) >= 0).all()
    assert (tracer.first(7 * aimed, -aimed) >= 0).all()


def test_a_material_without_a_brdf_is_named(busy):
    with pytest.raises(UnknownNameError, match=r"part body.*unknown material"):
        reference_image(busy, None, {"rmap": BRDFS["ramp"]})
