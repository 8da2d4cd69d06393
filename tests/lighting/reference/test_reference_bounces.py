"""Light that comes by way of other surfaces: closed forms, noise and refusals."""

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import plane
from metamer.lighting.reference import bounces as reference_bounces
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.scene import Part, Scene
from metamer.materials.analytic import CookTorrance, Lambert
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.spectral.bispectral import Bispectral, fluorophore
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM as NM
from metamer.spectral.spectrum import Spectrum

D65 = illuminant("D65")
WHITE = Lambert(Spectrum.sampled(NM, np.ones(81)))
GREY = Lambert(Spectrum.sampled(NM, np.full(81, 0.5)))
CAMERA = Camera(position=(0.0, 0.9, 2.2), target=(0.0, 0.3, 0.0), vertical_fov_deg=16, width=8, height_px=8, samples=2)


def corner(side=3.0):
    """A floor and a wall that meet at right angles, as one mesh seen from both sides."""
    floor = plane(side, side)
    wall = np.column_stack([floor.vertices[:, 0], floor.vertices[:, 2] + 0.5 * side, np.full(4, -0.5)])
    normals = np.concatenate([floor.normals, np.tile([0.0, 0.0, 1.0], (4, 1))])
    return Mesh(
        np.concatenate([floor.vertices, wall]), normals, np.concatenate([floor.faces, floor.faces[:, ::-1] + 4])
    )


def even(lux=1000.0):
    return EnvironmentLight(np.ones((1, 2, 4)), (D65,), lux)


def scene_of(light, *parts):
    parts = parts or (Part("corner", corner(), "matt"),)
    return Scene(parts, (light,), (CAMERA,), observer("1931_2"))


@pytest.mark.parametrize("bounces", [1, 12])
def test_a_white_furnace(bounces):
    """Where the same light comes from everywhere and nothing is lost, nothing can be told from anything."""
    scene = scene_of(even())
    found = reference_images(scene, None, {"matt": WHITE}, bounces=bounces, budget=2.0)
    y = found.xyz[0, ..., 1]
    if bounces == 1:
        assert y.min() < 0.97
    else:
        np.testing.assert_allclose(y, 1.0, atol=0.03)
        assert abs(y.mean() - 1.0) < 0.003


def test_a_floor_before_a_wall_under_a_lamp():
    """The wall receives the sun along its normal's cosine; the floor sees it by its form factor."""
    light = DirectionalLight((0.0, 0.0, 1.0), D65, 1000.0)
    camera = Camera(
        position=(0, 1, 1), target=(0, 0, 0), up=(0, 0, -1), vertical_fov_deg=2, width=2, height_px=2, samples=2
    )
    scene = Scene((Part("corner", corner(40.0), "matt"),), (light,), (camera,), observer("1931_2"))
    dark = reference_images(scene, None, {"matt": GREY}).xyz
    assert not dark.any()
    found = reference_images(scene, None, {"matt": GREY}, bounces=1, budget=2.0)
    # A wall without end fills half of the hemisphere by the cosine: 0.5 x 0.5 x 0.5.
    np.testing.assert_allclose(found.xyz[0, ..., 1].mean(), 0.125, rtol=0.03)


def test_no_bounces_is_the_same_picture():
    scene = scene_of(DirectionalLight((0.3, 1.0, 0.4), D65, 1000.0))
    plain, none = (reference_images(scene, None, {"matt": GREY}, **more) for more in ({}, {"bounces": 0}))
    assert np.array_equal(plain.xyz, none.xyz)
    assert none.noise is None


def test_equal_seeds_are_equal_pictures_and_the_noise_is_what_is_said():
    scene = scene_of(DirectionalLight((0.3, 1.0, 0.4), D65, 1000.0))
    more = {"bounces": 2, "budget": 4.0, "most_directions": 64}
    first, again, other = (reference_images(scene, None, {"matt": GREY}, seed=seed, **more) for seed in (0, 0, 1))
    assert np.array_equal(first.xyz, again.xyz)
    assert not np.array_equal(first.xyz, other.xyz)
    assert first.noise is not None
    assert first.noise.mean[0] > 0.0
    apart = np.abs(first.xyz - other.xyz).mean() / first.xyz.mean()
    assert apart < 0.05


def test_several_lights_at_once_are_each_as_if_alone():
    scene = scene_of(even())
    more = {"bounces": 1, "budget": 4.0, "most_directions": 64}
    both = reference_images(scene, None, {"matt": GREY}, (D65, illuminant("A")), **more)
    alone = reference_images(scene, None, {"matt": GREY}, (illuminant("A"),), **more)
    np.testing.assert_allclose(both.xyz[1], alone.xyz[0], rtol=1e-9)


def test_a_highlight_is_passed_on():
    """Gold above a floor: the floor is lit by what the gold throws down, of gold's colour."""
    black = Spectrum.sampled(NM, np.zeros(81))
    n, k = np.interp(NM, [400, 500, 600], [1.46, 1.0, 0.25]), np.interp(NM, [400, 500, 800], [2.0, 1.8, 5.0])
    surfaces = {"gold": CookTorrance(black, n, k, 0.3, 1.0, "ggx", "smith"), "matt": GREY}
    wall = corner()
    floor = Mesh(wall.vertices[:4], wall.normals[:4], wall.faces[:2])
    gold = Mesh(wall.vertices[4:], wall.normals[4:], wall.faces[2:] - 4)
    light = DirectionalLight((0.0, 0.5, 1.0), D65, 1000.0)
    scene = scene_of(light, Part("floor", floor, "matt"), Part("wall", gold, "gold"))
    direct, passed = (reference_images(scene, None, surfaces, bounces=n, budget=4.0).xyz[0] for n in (0, 1))
    added = (passed - direct).reshape(-1, 3).mean(axis=0)
    white = observer("1931_2").white(D65)
    assert added[1] > 0.05
    assert added[2] / white[2] < 0.7 * added[0] / white[0]


def dye(peak, to, base=0.3):
    """Takes in half of the light about `peak` nm, and sends out most of it about `to`."""
    nm = np.arange(380.0, 781.0, 10.0)
    about = lambda centre: np.exp(-(((nm - centre) / 30.0) ** 2))  # noqa: E731
    return fluorophore(Spectrum.sampled(nm, np.full(nm.size, base)), 0.5 * about(peak), about(to), 0.9)


def as_matrix(surface):
    own = surface.bispectral if isinstance(surface, FluorescentLambert) else Bispectral.diagonal(surface.reflectance)
    return own.on(EVERY)


EVERY = np.arange(360.0, 831.0)
GREEN, RED = FluorescentLambert(dye(420, 520)), FluorescentLambert(dye(520, 610, 0.2))


@pytest.mark.parametrize(("floor", "wall"), [(GREY, GREEN), (GREEN, GREY), (RED, GREEN)], ids=["last", "first", "both"])
@pytest.mark.parametrize("name", ["D65", "FL11"])
def test_fluorescence_on_the_way(floor, wall, name):
    """The floor sees half a hemisphere of wall, as in the test of the lamp: its matrix times the wall's, twice 0.5."""
    light = illuminant(name)
    camera = Camera(
        position=(0, 1, 1), target=(0, 0, 0), up=(0, 0, -1), vertical_fov_deg=2, width=2, height_px=2, samples=2
    )
    both = corner(40.0)
    meshes = (Mesh(both.vertices[k:][:4], both.normals[k:][:4], both.faces[k // 2 :][:2] - k) for k in (0, 4))
    parts = tuple(Part(name, mesh, name) for name, mesh in zip(("floor", "wall"), meshes, strict=True))
    lamp = DirectionalLight((0.0, 0.0, 1.0), light, 1000.0)
    scene = Scene(parts, (lamp,), (camera,), observer("1931_2"))
    found = reference_images(scene, None, {"floor": floor, "wall": wall}, bounces=1, budget=2.0)
    seen, power = observer("1931_2"), light.averaged(EVERY).samples
    sent = as_matrix(floor) @ as_matrix(wall) @ power
    expected = 0.5 * seen.sensitivity(EVERY) @ sent / seen.luminous(light)
    np.testing.assert_allclose(found.xyz[0].mean(axis=(0, 1)), expected, rtol=0.03)
    # Without fluorescence it would be another colour altogether.
    kept = [np.diag(np.diag(as_matrix(each))) for each in (floor, wall)]
    plain = 0.5 * seen.sensitivity(EVERY) @ kept[0] @ kept[1] @ power / seen.luminous(light)
    assert delta_e_xyz(plain, expected, seen.white(light)) > 3.0


@pytest.mark.slow
def test_paths_that_end_by_chance_are_right_where_light_is_shifted(monkeypatch):
    parts = (Part("corner", corner(), "matt"),)
    scene = Scene(parts, (even(),), (CAMERA,), observer("1931_2"))
    surface = FluorescentLambert(dye(420, 520, 0.5))
    more = {"bounces": 5, "budget": 2.0, "most_directions": 512}
    ended = reference_images(scene, None, {"matt": surface}, **more)
    monkeypatch.setattr(reference_bounces, "_ROULETTE", 99)
    whole = reference_images(scene, None, {"matt": surface}, **more)
    few = reference_images(scene, None, {"matt": surface}, **{**more, "bounces": 2})
    means = [one.xyz.mean(axis=(0, 1, 2)) for one in (whole, ended, few)]
    np.testing.assert_allclose(means[1], means[0], rtol=2e-3)
    assert (means[0] > 1.006 * means[2]).all()
