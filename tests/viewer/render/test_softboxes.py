"""Softboxes near by, in both renderers: beside one another and beside the reference."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.environment.softbox import SoftboxLight
from metamer.lighting.mesh import shapes
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.visibility.half_space import Before
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.viewer.render.light_cache import visibilities
from metamer.viewer.software.backend import software_session


def softbox(position=(1.2, 2.2, 1.6), target=(0, 0, 0), **more):
    return SoftboxLight(position, target, 1.6, 1.0, illuminant("D65"), **more)


def ball_on_a_floor(scenes, material="gloss", size=24, beyond=()):
    parts = [(shapes.sphere(3), material), (shapes.plane(6.0, 6.0).placed(translate=(0, -1.0, 0)), "matt"), *beyond]
    camera = Camera("near", (0.5, 1.0, 6.0), (0, -0.3, 0), vertical_fov_deg=34, width=size, height_px=size, samples=1)
    scene = scenes.scene_of(parts, [scenes.sun((0, 1, 0), 1.0)], camera)
    return replace(scene, lights=(softbox((1.5, 2.4, 1.8)),))


def apart(scene, one, other, seen):
    return delta_e_xyz(one[seen].astype(float), other[seen].astype(float), scene.adopted_white())


@pytest.mark.slow
@pytest.mark.parametrize("material", ["gloss", "sharp", "brushed"])
def test_gl_equals_numpy(scenes, drawn_by_both, material):
    near = replace(scenes.sphere_scene(material, size=20, samples=1), lights=(softbox(),))
    for scene in (near, ball_on_a_floor(scenes, material, size=16)):
        both = drawn_by_both(scene, dict(scenes.SURFACES))
        seen = both.coverage == 1.0
        some = np.abs(both.mine[seen])
        relative = np.abs(both.theirs - both.mine)[seen] / np.maximum(some, 1e-2 * some.max())
        assert np.percentile(relative, 99.9) < 1e-3
        assert both.off[seen].max() < 0.1


@pytest.mark.parametrize(("material", "most"), [("matt", 0.3), ("gloss", 0.6)])
def test_a_softbox_near_by_is_seen_from_each_place(scenes, material, most):
    # Seen alike from everywhere, as a light far off, it would be off by some 16.
    scene = replace(scenes.sphere_scene(material, size=24, samples=1), lights=(softbox(),))
    surfaces = {material: scenes.SURFACES[material]}
    drawn, coverage = software_session().render(scene, None, surfaces)
    truth = reference_images(scene, None, surfaces, budget=1.0)
    assert apart(scene, truth.xyz[0], drawn, coverage == 1.0).mean() < most


def test_soft_shadows_are_the_references(scenes):
    scene, surfaces = ball_on_a_floor(scenes, "matt"), {"matt": scenes.SURFACES["matt"]}
    drawn, coverage = software_session().render(scene, None, surfaces)
    truth = reference_images(scene, None, surfaces, budget=1.0)
    seen = coverage == 1.0
    off = apart(scene, truth.xyz[0], drawn, seen)
    assert off.mean() < 0.7 and np.percentile(off, 95) < 4.0
    # There is a shadow.
    alone, _ = software_session().render(replace(scene, parts=scene.parts[1:]), scene.camera(), surfaces)
    assert (truth.xyz[0][seen, 1] < 0.5 * alone[seen, 1]).mean() > 0.02


@pytest.mark.slow
def test_a_softbox_above_everything_needs_no_visibility_of_its_own(scenes):
    """Its plane may cut the floor: where the floor lies, no ray through the softbox comes."""
    scene, room = ball_on_a_floor(scenes, "matt"), EnvironmentLight(np.ones((1, 4, 8)), (illuminant("D65"),))
    above, aside = softbox((1.5, 2.4, 1.8)), softbox((2.5, 0.2, 1.8), target=(0, -0.5, 0))
    assert not all(Before(one.position, one.axes[2]).holds(scene.parts[1].mesh.vertices) for one in (above, aside))
    assert visibilities(replace(scene, lights=(above, room))) == 1
    assert visibilities(replace(scene, lights=(aside, room))) == 2


def test_what_stands_behind_a_softbox_does_not_hide_it(scenes):
    wall = shapes.plane(9.0, 9.0).placed(rotate_deg=(90, 0, 0), translate=(0, 0, 5.0)), "matt"
    camera = ball_on_a_floor(scenes).camera()
    before, beyond = ball_on_a_floor(scenes), ball_on_a_floor(scenes, beyond=(wall,))
    lamp = (softbox((0.0, 2.5, 3.0)),)
    before, beyond = replace(before, lights=lamp), replace(beyond, lights=lamp)
    camera = replace(camera, position=(0.5, 1.0, 4.0))
    surfaces = dict(scenes.SURFACES)
    one, coverage = software_session().render(before, camera, surfaces)
    other, _ = software_session().render(beyond, camera, surfaces)
    seen = coverage == 1.0
    assert one[seen, 1].max() > 0.3
    # Sites and axes of maps differ between the scenes, the light does not.
    assert apart(before, one, other, seen).mean() < 0.5
