"""Light between surfaces in fast pictures: both renderers beside paths at every wavelength, and beside each other."""

import json
from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.scene import Review
from metamer.lighting.scene_file.files import load_scene
from metamer.lighting.transfer import bounce_solver, indirect
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.factored.pack import FactoredBrdf, matt_brdf
from metamer.materials.svbrdf.maps import MappedSurface
from metamer.materials.svbrdf.texel_map import TexelMap
from metamer.materials.svbrdf.texture import SpectralTexture
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.palette import Palette
from metamer.spectral.spectrum import Spectrum
from metamer.viewer.gl.backend import gl_session
from metamer.viewer.render.indirect_cache import with_counted_bounces
from metamer.viewer.render.session import radiance_weights
from metamer.viewer.review.review import review
from metamer.viewer.software.backend import software_session

NM = np.linspace(380.0, 780.0, 81)
RED = np.interp(NM, [380, 560, 620, 780], [0.04, 0.08, 0.75, 0.8])


def matt(reflectance):
    return matt_brdf(np.ones(1), Palette.of(np.broadcast_to(reflectance, (1, 81)) / np.pi))


SURFACES = {"red": matt(RED), "white": matt(0.8), "grey": matt(0.5)}


def corner(scenes, *lights, wall="red", floor="white", size=24, body=True):
    """A floor before a wall, and a block that touches the floor."""
    upright = shapes.plane(2.0, 2.0).placed(rotate_deg=(90.0, 0.0, 0.0), translate=(0.0, 0.9, -1.0))
    parts = [(shapes.plane(2.0, 2.0).placed(translate=(0, -0.1, 0)), floor), (upright, wall)]
    if body:
        parts.append((shapes.sphere(2, 0.4).placed(translate=(0.2, 0.3, 0.0)), "grey"))
    camera = Camera("c", (1.2, 1.6, 3.2), (0, 0.4, -0.2), vertical_fov_deg=38.0, width=size, height_px=size, samples=1)
    return scenes.scene_of(parts, lights or [scenes.sun((0.3, 0.9, 0.5))], camera)


@pytest.mark.slow_cases("GL", "numpy")
def test_another_material_is_seen_by_way_of_others_too(scenes, make_session):
    """A renderer that has drawn the scene before draws what a new one draws."""
    lit = replace(corner(scenes), bounces="auto")
    dark = lit.with_material(lit.parts[0].name, "grey")
    with make_session() as renderer:
        before, after = (renderer.render(scene, None, SURFACES)[0].copy() for scene in (lit, dark))
        drawn = renderer.bounced.bounces
    with make_session() as renderer:
        np.testing.assert_array_equal(after, renderer.render(dark, None, SURFACES)[0])
        assert renderer.bounced.bounces == drawn
    # The block above the floor, lit from above and beside, is darker from below.
    assert (after[..., 1] < before[..., 1] - 1e-4).mean() > 0.3


def off(scene, truth, found):
    return delta_e_xyz(np.asarray(truth, float), np.asarray(found, float), scene.adopted_white())


@pytest.mark.slow
def test_pictures_are_the_paths(scenes, make_session):
    scene = replace(corner(scenes), bounces=2)
    truth = reference_images(scene, None, SURFACES, bounces=2, budget=1.0)
    with make_session() as renderer:
        found, coverage = renderer.render(scene, None, SURFACES)
        without, _ = renderer.render(replace(scene, bounces=0), None, SURFACES)
    whole = coverage == 1.0
    assert np.percentile(off(scene, truth.xyz[0], found)[whole], 95) < 1.0
    assert np.percentile(off(scene, truth.xyz[0], without)[whole], 95) > 3.0


@pytest.mark.slow
def test_gl_equals_numpy(scenes, gl):
    """Three light spectra, fields of which no draw call has all, and lobes."""
    lights = [scenes.sun((0.3, 0.9, 0.5)), scenes.lamp((1.0, 1.5, 1.0), 500.0), scenes.lamp((-1, 1, 1), 500.0, "FL11")]
    scene = replace(corner(scenes, *lights, wall="gloss"), bounces=2)
    surfaces = {**SURFACES, **scenes.SURFACES}
    twin, coverage = software_session().render(scene, None, surfaces)
    drawn, _ = gl_session(gl).render(scene, None, surfaces)
    with software_session() as renderer:
        without, _ = renderer.render(replace(scene, bounces=0), None, surfaces)
    assert off(scene, twin, drawn)[coverage == 1.0].max() < 0.05
    assert off(scene, twin, without)[coverage == 1.0].mean() > 1.0


def metal(scenes):
    """A lobe that reflects as metals do, four fifths of what comes at any angle."""
    coat = scenes.lobe_pack(0.2)
    at_half, at_difference, azimuth = (factor.copy() for factor in coat.factors)
    at_half[:, 1:], at_difference[:, 0] = 0.0, 0.8
    one = replace(coat, factors=(at_half, at_difference, azimuth), palette=Palette.of(np.ones((3, 81))))
    return FactoredBrdf((one,))


@pytest.mark.slow
def test_a_metal_mirrors_what_stands_about_it(scenes, make_session, monkeypatch):
    """A ball before a red wall, beside paths; what polynomials alone would show of it is far off."""
    surfaces = {**SURFACES, "grey": metal(scenes)}
    scene = replace(corner(scenes), bounces=2)
    truth = reference_images(scene, None, surfaces, bounces=2, budget=1.0)
    with make_session() as renderer:
        found, coverage = renderer.render(scene, None, surfaces)
    monkeypatch.setattr(indirect, "MOST_MAPS", 10)
    with make_session() as renderer:
        blunt, _ = renderer.render(scene, None, surfaces)
        assert "highlights without detail" in renderer.bounced.words
    ball = (coverage == 1.0) & (np.abs(found - blunt).max(axis=2) > 0.0)
    assert ball.sum() > 20
    near, far = (np.percentile(off(scene, truth.xyz[0], one)[ball], 90) for one in (found, blunt))
    assert near < 2.6 and near < 0.4 * far


@pytest.mark.slow_cases("GL")
def test_a_texture_receives_light_and_passes_it_on_texel_by_texel(scenes, make_session):
    stripes = np.where((np.arange(12) // 3 % 2)[None, :, None] == 1, 0.7, 0.1) * np.ones((12, 1, 81))
    texture = SpectralTexture(NM, stripes)
    scene = replace(corner(scenes, floor="stripes", body=False), bounces=1)
    originals, drawn = {**SURFACES, "stripes": texture}, {**SURFACES, "stripes": texture.own_form()}
    truth = reference_images(scene, None, originals, bounces=1, budget=1.0)
    with make_session() as renderer:
        found, coverage = renderer.render(scene, None, drawn)
    # The wall is lit by the stripes, not by their mean.
    assert np.percentile(off(scene, truth.xyz[0], found)[coverage == 1.0], 95) < 0.6


@pytest.mark.slow
def test_a_normal_map_leans_towards_the_light_of_a_wall(scenes, make_session):
    """A floor whose normals lean towards a red wall, beside paths: indirect light follows the map."""
    lean = np.broadcast_to(np.array([0.0, np.sin(0.35), np.cos(0.35)], np.float32), (4, 4, 3))
    grey, rough = np.full((4, 4, 3), 200, np.uint8), np.full((4, 4, 1), 0.9, np.float32)
    flat = MappedSurface(NM, TexelMap(grey, srgb=True), TexelMap(rough), "mallett-yuksel")
    maps = replace(flat, normal=TexelMap(np.ascontiguousarray(lean)))
    scene = replace(corner(scenes, floor="leaning", body=False), bounces=1)
    originals, drawn = {**SURFACES, "leaning": maps}, {**SURFACES, "leaning": maps.own_form(1e-3)}
    truth, direct = (reference_images(scene, None, originals, bounces=count, budget=1.0).xyz[0] for count in (1, 0))
    with make_session() as renderer:
        found, coverage = renderer.render(scene, None, drawn)
        without, _ = renderer.render(replace(scene, bounces=0), None, drawn)
    floor = (coverage == 1.0) & (np.arange(24) > 14)[:, None]
    expected, added = (truth - direct)[floor][:, 0], (found - without)[floor][:, 0]
    with make_session() as renderer:
        level, _ = renderer.render(scene, None, {**SURFACES, "leaning": flat.own_form(1e-3)})
        level -= renderer.render(replace(scene, bounces=0), None, {**SURFACES, "leaning": flat.own_form(1e-3)})[0]
    assert level[floor][:, 0].mean() < 0.7 * expected.mean()
    assert np.abs(added - expected).mean() < 0.1 * expected.mean()


@pytest.mark.slow_cases("GL")
def test_a_sheet_shines_on_both_of_its_sides(scenes, make_session):
    """Lit from above, it is red below from the floor's light: each side has sites of its own."""
    sheet = shapes.plane(0.8, 0.8).placed(translate=(0.0, 0.6, 0.0))
    floor = shapes.plane(3.0, 3.0)
    camera = Camera("below", (0.0, 0.1, 1.4), (0.0, 0.6, 0.0), vertical_fov_deg=40.0, width=24, height_px=24, samples=1)
    scene = scenes.scene_of([(sheet, "white"), (floor, "red")], [scenes.sun((0.5, 0.8, 0.6))], camera)
    scene = replace(scene, bounces=1)
    with make_session() as renderer:
        found, coverage = renderer.render(scene, None, SURFACES)
        direct, _ = renderer.render(replace(scene, bounces=0), None, SURFACES)
    truth = reference_images(scene, None, SURFACES, bounces=1, budget=1.0).xyz[0]
    dark = (coverage == 1.0) & (direct[..., 1] == 0.0) & (np.arange(24) < 12)[:, None]
    assert dark.sum() > 20
    assert (found[dark][:, 0] > 1.2 * found[dark][:, 1]).all(), "the floor is red"
    assert np.percentile(off(scene, truth, found)[dark], 95) < 1.5


def test_one_convex_body_has_no_bounces(scenes, make_session):
    scene = scenes.sphere_scene("matt", size=16)
    with make_session() as renderer:
        plain, _ = renderer.render(scene, None, scenes.SURFACES)
        bounced, _ = renderer.render(replace(scene, bounces="auto"), None, scenes.SURFACES)
        assert renderer.bounced is None
    np.testing.assert_array_equal(plain, bounced)


def test_black_surroundings_change_nothing(scenes, make_session):
    scene = replace(corner(scenes, wall="black", floor="black"), bounces="auto")
    surfaces = {**SURFACES, "black": matt(0.0), "grey": matt(0.0)}
    with make_session() as renderer:
        found, _ = renderer.render(scene, None, surfaces)
        assert renderer.bounced is None and not found.any()


@pytest.mark.slow_cases("GL", "numpy")
def test_other_illuminants_and_spectra_tell_the_same(scenes, make_session):
    """Folding afresh is drawing anew, and spectra add up to the colours."""
    scene = replace(corner(scenes), bounces=2)
    other = illuminant("A")
    with make_session() as renderer:
        folded = renderer.render_many(scene, None, SURFACES, (None, other))[1][0]
        anew = renderer.render(scene.with_illuminant(other, "A"), None, SURFACES)[0]
        spectra = renderer.render_spectra(scene.with_illuminant(other, "A"), None, SURFACES, NM)
    assert off(scene, anew, folded).max() < 0.1
    # 1 is the perfect diffuser under equal energy: times the light's own XYZ sums they are its picture.
    seen = spectra.astype(float) @ radiance_weights(scene.observer, NM).T
    assert off(scene, anew, seen).max() < 0.3


@pytest.mark.slow
def test_bounces_follow_when_a_mesh_or_a_material_changes(scenes, make_session):
    """What is kept is not shown of another scene."""
    scene = replace(corner(scenes), bounces=1)
    moved = replace(
        scene, parts=(*scene.parts[:2], replace(scene.parts[2], mesh=scene.parts[2].mesh.placed(translate=(0.2, 0, 0))))
    )
    others = {**SURFACES, "red": matt(RED[::-1])}
    with make_session() as renderer:
        renderer.render(scene, None, SURFACES)
        for scene_now, surfaces in ((scene, others), (moved, others), (replace(moved, bounces=2), others)):
            kept, _ = renderer.render(scene_now, None, surfaces)
            with software_session() as fresh:
                anew, _ = fresh.render(scene_now, None, surfaces)
            assert off(scene, anew, kept).max() < 0.05


@pytest.mark.slow
def test_a_review_gives_picture_and_reference_the_same_bounces(scenes, tiny_catalogue, tmp_path):
    """Were one of them without, all pixels of the wall would be far off."""
    catalogue = Catalogue.open(tiny_catalogue)
    scene = corner(scenes, wall="tiny/matt-red", floor="tiny/matt-red", body=False, size=16)
    scene = replace(scene, review=Review("part1", ("tiny/matt-red",), ("A",)), bounces="auto")
    found = review(scene, catalogue, tmp_path / "review", renderer=software_session(), version="test")
    surfaces = {"tiny/matt-red": catalogue.surface("tiny/matt-red").drawn()}
    with software_session() as renderer:
        xyz, coverage = renderer.render(scene, None, surfaces)
        assert renderer.bounced is not None
        bounces = renderer.bounced.bounces
        assert with_counted_bounces(scene, surfaces).bounces == bounces >= 2
        direct, _ = renderer.render(replace(scene, bounces=0), None, surfaces)
    assert off(scene, xyz, direct)[coverage == 1.0].mean() > 1.0
    assert found.rows[0].statistics.p95 < 1.0
    chain = json.loads(found.figures.read_text(encoding="utf-8"))["colour_chain"]
    assert [words for words in chain if f"and interreflection, {bounces} bounces." in words]


def test_scenes_say_how_many_bounces_they_have(tmp_path):
    for said, bounces in (("", 0), ("bounces = 3", 3), ('bounces = "auto"', "auto")):
        (tmp_path / "scene.toml").write_text(
            f'[[part]]\nshape = "plane"\n[interreflection]\n{said}\n', encoding="utf-8"
        )
        assert load_scene(tmp_path / "scene.toml").bounces == bounces


@pytest.mark.slow_cases("GL")
def test_three_spectra_at_once_are_the_paths(scenes, make_session):
    """Daylight, a tungsten lamp and one of few lines: each colours what the wall sends on in its own way."""
    lights = [scenes.sun((0.3, 0.9, 0.5)), scenes.lamp((1, 1.5, 1), 4e3, "A"), scenes.lamp((-1, 1, 1), 4e3, "FL11")]
    scene = replace(corner(scenes, *lights, body=False, size=12), bounces=1)
    truth = reference_images(scene, None, SURFACES, bounces=1, budget=1.0).xyz[0]
    with make_session() as renderer:
        found, coverage = renderer.render(scene, None, SURFACES)
        without, _ = renderer.render(replace(scene, bounces=0), None, SURFACES)
    whole = coverage == 1.0
    assert np.percentile(off(scene, truth, found)[whole], 95) < 1.0
    assert np.percentile(off(scene, truth, without)[whole], 95) > 3.0


def test_light_of_one_line_is_the_paths(scenes, make_session):
    """A sun of one wavelength: what the wall sends on has its colour, and the strength that the wall has there."""
    line = Spectrum.sampled(NM, np.where(NM == 610.0, 1.0, 0.0), "emission")
    scene = replace(corner(scenes, replace(scenes.sun((0.3, 0.9, 0.5)), spectrum=line), body=False, size=12), bounces=1)
    truth = reference_images(scene, None, SURFACES, bounces=1, budget=1.0).xyz[0]
    with make_session() as renderer:
        found, coverage = renderer.render(scene, None, SURFACES)
        without, _ = renderer.render(replace(scene, bounces=0), None, SURFACES)
    whole = coverage == 1.0
    assert np.percentile(off(scene, truth, found)[whole], 95) < 1.0
    assert np.percentile(off(scene, truth, without)[whole], 95) > 3.0


@pytest.mark.slow
def test_a_glossy_floor_throws_the_sun_onto_a_wall(scenes, make_session, monkeypatch):
    """Its highlight, as paths have it; a floor that passes light on as a matt one has none."""
    surfaces = {**SURFACES, "white": metal(scenes)}
    scene = replace(corner(scenes, scenes.sun((0.2, 0.5, 0.8), 3000.0), wall="grey", body=False), bounces=1)
    truth = reference_images(scene, None, surfaces, bounces=1, budget=1.0)
    with make_session() as renderer:
        found, coverage = renderer.render(scene, None, surfaces)
    monkeypatch.setattr(bounce_solver, "glossy_parts", lambda *_: {})
    with make_session() as renderer:
        evenly, _ = renderer.render(scene, None, surfaces)
    near, far = (np.percentile(off(scene, truth.xyz[0], one)[coverage == 1.0], 95) for one in (found, evenly))
    assert near < 0.25 * far and far > 3.0, (near, far)
