"""Lights that spread, in both renderers: beside one another, beside sums over every texel, turned, folded, kept."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.environment import bright_light, latlong
from metamer.lighting.environment.brights import taken_apart
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.mesh import shapes
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.visibility import edge_refinement, refinement
from metamer.materials.core.points import Points
from metamer.materials.factored.pack import FactoredBrdf, matt_brdf
from metamer.runtime.errors import InputError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.palette import Palette
from metamer.viewer.gl.backend import gl_session
from metamer.viewer.render.session import radiance_weights
from metamer.viewer.render.surfaces import surface_samples
from metamer.viewer.software.backend import software_session

SPECTRA = tuple(illuminant(name) for name in ("D65", "A", "FL11", "FL2", "D50"))


def sky(fields=1, height=32, contrast=3.0, **settings):
    """Clouds, a bright patch, and less from below; every field of another shape."""
    to = latlong.texel_directions(height, 2 * height)
    made = []
    for number in range(fields):
        axis = np.array([np.sin(number + 0.5), 0.6, np.cos(number + 0.5)])
        patch = np.exp(20.0 * (to @ (axis / np.linalg.norm(axis)) - 1.0))
        made.append(1.0 + 0.5 * np.sin(3.0 * to[..., 0] + number) + contrast * patch + 0.5 * to[..., 1])
    return EnvironmentLight(np.array(made), SPECTRA[:fields], **settings)


def under(scene, *lights):
    return replace(scene, lights=lights)


@pytest.mark.slow_cases("GL")
def test_a_white_ball_in_an_even_light_is_white_everywhere(scenes, make_session):
    matt = FactoredBrdf((scenes.lambert_pack(np.ones(81)),))
    light = EnvironmentLight(np.ones((1, 8, 16)), SPECTRA[:1], illuminance_lux=1000.0)
    xyz, coverage = make_session().render(under(scenes.sphere_scene(), light), None, {"gloss": matt})
    white = SPECTRA[0]
    expected = scenes.sphere_scene().observer.white(white)
    assert np.abs(xyz[coverage == 1.0] - expected).max() < 2e-3


@pytest.mark.parametrize(
    ("material", "fields"),
    [
        ("gloss", 1),
        pytest.param("gloss", 5, marks=pytest.mark.slow),
        ("sharp", 1),
        pytest.param("brushed", 5, marks=pytest.mark.slow),
    ],
)
def test_gl_equals_numpy(scenes, drawn_by_both, material, fields):
    scene = under(scenes.sphere_scene(material, size=32, samples=2), sky(fields, rotation_deg=70.0))
    both = drawn_by_both(scene, dict(scenes.SURFACES))
    there = both.coverage > 0.0
    some = np.abs(both.mine[there])
    relative = np.abs(both.theirs - both.mine)[there] / np.maximum(some, 1e-2 * some.max())
    assert np.percentile(relative, 99.9) < 1e-3
    assert both.off[both.coverage == 1.0].max() < 0.1


@pytest.mark.slow
def test_gl_equals_numpy_where_parts_hide_light_from_each_other(scenes, drawn_by_both, monkeypatch):
    monkeypatch.setattr(refinement, "MOST_VERTICES", 400)
    # Balls of which one shades the other, on a ground of two triangles; and a cloth whose back is seen.
    for scene in (scenes.two_balls(), scenes.cloth_scene("gloss", size=32, samples=1, divisions=10)):
        scene = under(scene, sky(2, contrast=30.0, rotation_deg=20.0))
        surfaces = dict(scenes.SURFACES)
        both = drawn_by_both(scene, surfaces)
        seen = both.coverage == 1.0
        assert both.off[seen].max() < 0.1, scene.name
        open_sky = replace(scene, parts=scene.parts[-1:])
        alone, _ = software_session().render(open_sky, scene.camera(), surfaces)
        assert (both.mine[seen, 1] < 0.8 * alone[seen, 1]).mean() > 0.02


@pytest.mark.slow
@pytest.mark.parametrize("shape", [shapes.speed_shape(3), shapes.cloth(10)])
def test_gl_equals_numpy_where_triangles_are_cut_between_their_vertices(scenes, gl, shape, monkeypatch):
    monkeypatch.setattr(refinement, "MOST_VERTICES", 10)
    monkeypatch.setattr(edge_refinement, "APART", 0.02)
    shade = shapes.sphere(1, 0.31).placed(translate=(0.3, 1.1, 0.4))
    camera = Camera("near", (0.5, 2.0, 5.0), (0, 0, 0), vertical_fov_deg=28, width=32, height_px=32, samples=1)
    scene = scenes.scene_of([(shape, "gloss"), (shade, "matt")], [scenes.sun((-0.5, 0.8, 0.3), 400.0)], camera)
    scene = under(scene, sky(2, contrast=30.0, rotation_deg=20.0))
    surfaces = dict(scenes.SURFACES)
    numpy = software_session()
    twin, coverage = numpy.render(scene, None, surfaces)
    assert len(numpy.layers.shadows(numpy.settings, scene.spread_lights[0], scene).visibility.middles) > 20
    drawn, _ = gl_session(gl).render(scene, None, surfaces)
    seen = coverage == 1.0
    apart = delta_e_xyz(twin[seen].astype(float), drawn[seen].astype(float), scene.adopted_white())
    assert apart.max() < 0.1 and seen.sum() > 150


@pytest.mark.slow
def test_shadows_under_a_sky_are_the_references(scenes):
    # A small sun in a sky, on matt balls and ground: both of bright parts and of the rest.
    scene = under(scenes.two_balls("matt", 24), sky(1, contrast=300.0))
    surfaces = {"matt": scenes.SURFACES["matt"]}
    drawn, coverage = software_session().render(scene, None, surfaces)
    truth = reference_images(scene, None, surfaces, budget=3.0)
    seen = coverage == 1.0
    white = scene.adopted_white()
    apart = delta_e_xyz(truth.xyz[0][seen], drawn[seen].astype(float), white)
    assert apart.mean() < 0.8 + truth.noise.mean[0] and np.percentile(apart, 90) < 2.0
    unshadowed = np.abs(truth.xyz[0][seen, 1] / drawn[seen, 1] - 1.0)
    assert np.median(unshadowed) < 0.03


@pytest.mark.slow
def test_a_gloss_that_a_table_cuts_off_loses_the_dark_ground_and_not_the_sky(scenes):
    # Rough metal just above a wide table, under a bright sky over dark ground. What its upper part sees of the table
    # is little, and without the table as dark: a share of all that lobes see would be off by 0.19, 0.63 and 0.84.
    table, ball = shapes.plane(8.0, 8.0).placed(translate=(0, -1.02, 0)), shapes.sphere(3)
    camera = Camera("near", (0.5, 0.6, 5.0), (0, 0, 0), vertical_fov_deg=24, width=24, height_px=24, samples=1)
    to = latlong.texel_directions(32, 64)
    light = EnvironmentLight(np.where(to[..., 1] > 0.0, 1.0, 0.02)[None], SPECTRA[:1])
    scene = under(scenes.scene_of([(ball, "metal"), (table, "matt")], [scenes.sun()], camera), light)
    surfaces = {"metal": FactoredBrdf((scenes.lobe_pack(0.3),)), "matt": scenes.SURFACES["matt"]}
    drawn, coverage = software_session().render(scene, None, surfaces)
    alone, of_ball = software_session().render(replace(scene, parts=scene.parts[:1]), None, surfaces)
    upper = (coverage == 1.0) & (of_ball == 1.0) & (np.arange(24)[:, None] < 15)
    apart = delta_e_xyz(alone[upper].astype(float), drawn[upper].astype(float), scene.adopted_white())
    assert upper.sum() > 200 and apart.mean() < 0.1 and np.percentile(apart, 95) < 0.3 and apart.max() < 0.5


@pytest.mark.slow
def test_pictures_are_sums_over_every_texel(scenes):
    # Dark and wide lobes, an anisotropic one among them, against f_r cos(theta_i) of the packs at all 2,048 directions.
    light = sky(2, rotation_deg=-40.0)
    to = light.world_from_map @ latlong.texel_directions(32, 64).reshape(-1, 3).T
    weight = light.fields.reshape(2, -1) * np.repeat(latlong.solid_angles(32, 64), 64)
    for material, most in (("gloss", 1.0), ("brushed", 1.5)):
        scene = under(scenes.sphere_scene(material, size=16, samples=1), light)
        renderer, surfaces = software_session(), dict(scenes.SURFACES)
        drawn, coverage = renderer.render(scene, None, surfaces)
        (piece,) = renderer.cache.pieces
        view = renderer.cache.view
        surface = surface_samples(view, piece.window, view.triangles(piece.window))
        found = np.zeros((coverage.size, 3))
        for pixel, frame, eye in zip(surface.pixel, surface.frame, surface.to_viewer, strict=True):
            wi = (frame @ to).T
            f_r = surfaces[material].at(Points(wi, np.broadcast_to(frame @ eye, wi.shape)))
            for spectrum, power in zip(light.spectra, weight, strict=True):
                reflected = (np.maximum(wi[:, 2], 0.0) * power) @ f_r
                found[pixel] += (
                    np.pi / 1000.0 * scene.observer.weights(spectrum, np.arange(380.0, 781.0, 5.0)) @ reflected
                )
        off = delta_e_xyz(found, drawn.reshape(-1, 3).astype(float), scene.adopted_white())
        assert off[coverage.ravel() > 0.0].mean() < 0.4, material
        assert off[coverage.ravel() > 0.0].max() < most, material


@pytest.mark.slow_cases("GL")
def test_a_turned_light_is_a_map_with_its_columns_moved(scenes, make_session):
    scene, surfaces = scenes.sphere_scene(size=32, samples=1), dict(scenes.SURFACES)
    still = sky(1)
    turned = replace(still, rotation_deg=90.0)
    assert turned.fields is still.fields
    # Seen from above, right-handed about +y: from +z to +x, a quarter of the columns to the left.
    moved = replace(still, fields=np.roll(still.fields, -16, axis=2))
    renderer = make_session()
    one, _ = renderer.render(under(scene, turned), None, surfaces)
    other, _ = renderer.render(under(scene, moved), None, surfaces)
    assert np.abs(one - other).max() < 2e-3 * np.abs(one).max()
    assert len(renderer.layers.lights._gathered) == 2
    assert np.abs(one - renderer.render(under(scene, still), None, surfaces)[0]).max() > 0.02
    assert len(renderer.layers.lights._gathered) == 2


@pytest.mark.slow
def test_turning_a_light_finds_no_bright_parts_anew_and_draws_what_a_new_renderer_draws(
    scenes, make_session, monkeypatch
):
    scene, surfaces = scenes.two_balls(size=24), dict(scenes.SURFACES)
    light = sky(2, contrast=300.0)
    found = []
    monkeypatch.setattr(bright_light, "taken_apart", lambda *args: found.append(args) or taken_apart(*args))
    renderer = make_session()
    renderer.render(under(scene, light), None, surfaces)
    for angle in (35.0, 120.0, -60.0, 200.0, 0.0):
        turned = replace(light, rotation_deg=angle)
        drawn, coverage = renderer.render(under(scene, turned), None, surfaces)
    assert len(found) == 1 and len(renderer.layers.lights._turned) <= 4
    for angle in (35.0, 137.0):
        turned = replace(light, rotation_deg=angle)
        drawn, coverage = renderer.render(under(scene, turned), None, surfaces)
        anew, _ = make_session().render(under(scene, turned), None, surfaces)
        relative = np.abs(drawn - anew)[coverage > 0.0] / np.maximum(anew[coverage > 0.0], 1e-3)
        assert np.percentile(relative, 99.9) < 1e-5


@pytest.mark.slow
def test_spectra_add_up_and_another_illuminant_replaces_all(scenes, make_session):
    scene, surfaces = scenes.sphere_scene(size=24, samples=1), dict(scenes.SURFACES)
    both = sky(2)
    apart = [
        replace(both, fields=both.fields[[k]], spectra=both.spectra[k : k + 1], illuminance_lux=None) for k in (0, 1)
    ]
    renderer = make_session()
    whole, _ = renderer.render(under(scene, both), None, surfaces)
    parts = [renderer.render(under(scene, one), None, surfaces)[0] for one in apart]
    assert np.allclose(whole, parts[0] + parts[1], atol=1e-5 * whole.max())
    (lamp, _), (own, _) = renderer.render_many(under(scene, both), None, surfaces, (SPECTRA[2], None))
    assert np.allclose(own, whole, atol=1e-6)
    only = renderer.render(under(scene, both.with_spectrum(SPECTRA[2])), None, surfaces)[0]
    assert np.allclose(lamp, only, atol=1e-5 * lamp.max())


@pytest.mark.slow_cases("GL", "numpy")
def test_kept_terms_and_delta_lights_beside_make_the_same_picture(scenes, make_session):
    scene, surfaces = scenes.two_balls(), dict(scenes.SURFACES)
    light = sky(1)
    mixed = under(scene, *scene.lights, light)
    kept = make_session("linear", True)
    first, _ = kept.render(mixed, None, surfaces)
    again, _ = kept.render(mixed, None, surfaces)
    assert np.array_equal(first, again)
    plain = make_session()
    alone, _ = plain.render(under(scene, light), None, surfaces)
    deltas, _ = plain.render(scene, None, surfaces)
    assert np.allclose(first, alone + deltas, atol=2e-5 * first.max())


@pytest.mark.slow
def test_more_terms_than_a_draw_call_takes_make_the_same_picture(scenes, gl):
    # Six rows of four terms of each of three fields: folded by five and one, kept by one at a time.
    form = scenes.SURFACES["gloss"].environment_form()
    numbers = np.random.default_rng(4).uniform(0.0, 1.0, (form.palette.rank, 22))
    spectra = np.random.default_rng(5).uniform(0.0, 0.1, (22, form.palette.values.shape[2]))
    many = replace(form, value=form.value @ numbers, palette=Palette(spectra[None], form.palette.basis))
    surfaces = {"gloss": replace(matt_brdf(np.ones(22), many.palette), slices=many)}
    scene = under(scenes.sphere_scene(size=24, samples=1), sky(3, rotation_deg=20.0))
    twin, _ = software_session().render(scene, None, surfaces)
    for renderer in (gl_session(gl), gl_session(gl, keeps_terms=True)):
        drawn, _ = renderer.render(scene, None, surfaces)
        assert np.abs(drawn - twin).max() < 1e-4 * np.abs(twin).max()


@pytest.mark.slow_cases("GL")
def test_spectral_pictures_fold_to_the_same_colours(scenes, make_session):
    scene, surfaces = under(scenes.sphere_scene(size=16, samples=1), sky(2)), dict(scenes.SURFACES)
    renderer = make_session()
    nm = np.arange(380.0, 781.0, 5.0)
    spectra = renderer.render_spectra(scene, None, surfaces, nm)
    xyz, _ = renderer.render(scene, None, surfaces)
    assert np.abs(spectra @ radiance_weights(scene.observer, nm).T - xyz).max() < 2e-3


def test_a_form_that_does_not_know_its_environment_is_refused(scenes, make_session):
    class Silent(FactoredBrdf):
        NAME = "silent"

        def environment_form(self):
            return super(FactoredBrdf, self).environment_form()

    silent = Silent(scenes.SURFACES["gloss"].packs)
    with pytest.raises(InputError, match="cannot be lit from all around"):
        make_session().render(under(scenes.sphere_scene(), sky()), None, {"gloss": silent})
