"""The GL renderer, its numpy twin and the ray-traced reference make the same picture, over all pixels."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.lighting.reference.reference import reference_image, reference_images
from metamer.materials.factored.pack import FactoredBrdf
from metamer.runtime.errors import UnknownNameError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.viewer.gl.backend import create_session, gl_session
from metamer.viewer.render.geometry import scene_geometry
from metamer.viewer.render.view import view_key
from metamer.viewer.software.backend import software_session


@pytest.fixture(scope="module")
def brdfs(scenes):
    return dict(scenes.SURFACES)


@pytest.fixture(scope="module")
def hardware(gl):
    renderer = gl_session(gl)
    yield renderer
    renderer.close()


@pytest.fixture(scope="module")
def software():
    return software_session()


def difference(reference, sample, scene):
    white = scene.adopted_white()
    return delta_e_xyz(np.asarray(reference, dtype=float), np.asarray(sample, dtype=float), white, method="CIE 1994")


def worst(delta, reference, sample):
    at = np.unravel_index(np.argmax(delta), delta.shape)
    return f"worst pixel {at}: ΔE94 {delta[at]:.4f}, {reference[at]} against {sample[at]}"


ALL = {
    "sphere": lambda scenes: scenes.sphere_scene(),
    "sharp lobe": lambda scenes: scenes.sphere_scene("sharp"),
    "anisotropic, hd": lambda scenes: scenes.sphere_scene("brushed"),
    "anisotropic, io, cloth with uv": lambda scenes: scenes.cloth_scene("woven"),
    "cloth with shadows, perspective": lambda scenes: scenes.cloth_scene(),
    "lamp, sun and three parts": lambda scenes: scenes.lamp_scene(),
    "one sample a pixel": lambda scenes: scenes.lamp_scene(samples=1),
    "a lamp a thousand times as far as the scene is wide": lambda scenes: scenes.far_lamp_scene(),
}


@pytest.mark.parametrize("name", ALL)
def test_gl_equals_numpy_over_all_pixels(scenes, hardware, software, name):
    scene = ALL[name](scenes)
    mine, coverage = software.render(scene, None, scenes.SURFACES)
    theirs, their_coverage = hardware.render(scene, None, scenes.SURFACES)
    np.testing.assert_array_equal(coverage, their_coverage)
    assert 0.05 < coverage.mean() <= 1.0
    seen = coverage > 0
    relative = np.abs(mine - theirs)[seen] / np.maximum(np.abs(mine[seen]), 1e-6)
    assert np.percentile(relative, 99.9) < 1e-3
    delta = difference(mine, theirs, scene)
    assert delta.max() < 0.1, worst(delta, mine, theirs)
    np.testing.assert_array_equal(theirs[~seen], 0.0)
    np.testing.assert_array_equal(mine[~seen], 0.0)


@pytest.mark.parametrize("name", ALL)
def test_numpy_agrees_with_rays(scenes, brdfs, software, name):
    scene = ALL[name](scenes)
    mine, coverage = software.render(scene, None, scenes.SURFACES)
    reference, their_coverage = reference_image(scene, None, brdfs)
    seen = their_coverage > 0
    delta = difference(reference, mine, scene)[seen]
    samples = scene.camera().samples
    assert (np.abs(coverage - their_coverage) < 1.01 / samples**2).all()
    assert (coverage != their_coverage.astype(np.float32)).mean() < 1e-3
    # One sample a pixel has nothing to average a shadow's edge with.
    assert np.percentile(delta, 99) < (0.1 if samples > 1 else 1.0)
    assert delta.mean() < 0.05


def test_a_lambert_sphere_is_the_cosine(scenes, hardware, software):
    scene = scenes.sphere_scene("white", size=48, samples=1)
    white = {"white": FactoredBrdf((scenes.lambert_pack(np.ones(scenes.BASIS.size)),))}
    light = scene.lights[0]
    origins, _ = scene.camera().rays()
    across = np.sum(origins[..., :2] ** 2, axis=-1)
    normal = np.concatenate([origins[..., :2], np.sqrt(np.maximum(1 - across, 0.0))[..., None]], axis=-1)
    cosine = np.maximum(normal @ light.direction_to_light, 0.0)
    inside = across < 0.95
    for renderer in (software, hardware):
        xyz, coverage = renderer.render(scene, None, white)
        assert coverage[inside].all() and not coverage[across > 1.0].any()
        # Flat triangles put a point of the sphere up to 1e-3 beside where it is, and have a horizon of their own.
        near_horizon = np.abs(cosine) < 0.05
        np.testing.assert_allclose(xyz[inside & ~near_horizon, 1], cosine[inside & ~near_horizon], atol=4e-3)
        whites = scene.observer.white(light.spectrum)
        lit = inside & (cosine > 0.1)
        np.testing.assert_allclose(xyz[lit] / xyz[lit, 1:2], np.broadcast_to(whites, xyz[lit].shape), rtol=1e-5)


def test_several_illuminants_are_several_renders(scenes, brdfs, hardware, software):
    scene = scenes.lamp_scene(size=32)
    spectra = [None, illuminant("A"), illuminant("FL11"), illuminant("D50"), illuminant("FL2")]
    for renderer in (software, hardware):
        many = renderer.render_many(scene, None, scenes.SURFACES, spectra)
        assert len(many) == len(spectra)
        for spectrum, (xyz, coverage) in zip(spectra, many, strict=True):
            relit = scene if spectrum is None else scene.with_illuminant(spectrum)
            one, one_coverage = renderer.render(relit, None, scenes.SURFACES)
            np.testing.assert_allclose(xyz, one, rtol=1e-5, atol=1e-7)
            np.testing.assert_array_equal(coverage, one_coverage)
    reference = reference_images(scene, None, brdfs, spectra)
    for picture, (xyz, _) in zip(reference.xyz, many, strict=True):
        assert np.percentile(difference(picture, xyz, scene), 99) < 0.5


@pytest.mark.parametrize("flip", [False, True])
def test_the_nearer_part_is_seen_whatever_is_drawn_first(scenes, hardware, software, flip):
    small = shapes.sphere(3, 0.4)
    lift = np.eye(4)
    lift[2, 3] = 2.0
    parts = [(shapes.sphere(4), "matt"), (small.transformed(lift), "red")]
    camera = scenes.sphere_scene(size=32).camera()
    scene = scenes.scene_of(parts[::-1] if flip else parts, [scenes.sun((0, 0, 1))], camera)
    packs = scenes.SURFACES | {"red": FactoredBrdf((scenes.lambert_pack(np.where(np.arange(81) > 45, 1.0, 0.0)),))}
    for renderer in (software, hardware):
        xyz, _ = renderer.render(scene, None, packs)
        assert xyz[16, 16, 0] > 1.5 * xyz[16, 16, 1]
        assert xyz[16, 4, 0] < 1.3 * xyz[16, 4, 1]


def test_parts_that_pass_through_each_other(scenes, brdfs, hardware, software):
    """The line where two surfaces meet is decided alike, sample for sample."""
    plane = shapes.plane(3, 3)
    tilt = np.eye(4)
    tilt[:3, :3] = [[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]]
    parts = [(plane, "matt"), (plane.transformed(tilt), "gloss"), (shapes.sphere(4, 0.7), "sharp")]
    camera = Camera("c", (1, 4, 3), (0, 0, 0), vertical_fov_deg=40, width=64, height_px=64)
    scene = scenes.scene_of(parts, [scenes.sun(), scenes.lamp()], camera)
    mine, coverage = software.render(scene, None, scenes.SURFACES)
    theirs, their_coverage = hardware.render(scene, None, scenes.SURFACES)
    np.testing.assert_array_equal(coverage, their_coverage)
    delta = difference(mine, theirs, scene)
    assert delta.max() < 0.1, worst(delta, mine, theirs)
    reference, _ = reference_image(scene, None, brdfs)
    assert np.percentile(difference(reference, mine, scene), 99) < 1.0


def test_a_camera_inside_the_scene(scenes, brdfs, hardware, software):
    """Triangles behind the camera, and a floor that runs under it."""
    camera = Camera("inside", (0, 0.3, 1.5), (0, 0.2, -1), vertical_fov_deg=70, width=48, height_px=32)
    back = np.eye(4)
    back[2, 3] = 3.0
    parts = [(shapes.plane(12, 12), "matt"), (shapes.sphere(3, 0.5).transformed(back), "gloss"),
             (shapes.sphere(3, 0.5), "gloss")]  # fmt: skip
    scene = scenes.scene_of(parts, [scenes.sun(), scenes.lamp((0.5, 2.0, 0.5))], camera)
    mine, coverage = software.render(scene, None, scenes.SURFACES)
    theirs, their_coverage = hardware.render(scene, None, scenes.SURFACES)
    np.testing.assert_array_equal(coverage, their_coverage)
    assert difference(mine, theirs, scene).max() < 0.1
    reference, reference_coverage = reference_image(scene, None, brdfs)
    np.testing.assert_allclose(coverage, reference_coverage, atol=0.12)
    assert np.percentile(difference(reference, mine, scene), 99) < 0.5


def test_nothing_visible_is_an_empty_picture(scenes, hardware, software):
    camera = Camera("away", (0, 0, 4), (0, 0, 8), vertical_fov_deg=30, width=16, height_px=12)
    scene = scenes.scene_of([(shapes.sphere(2), "gloss")], [scenes.sun()], camera)
    for renderer in (software, hardware):
        xyz, coverage = renderer.render(scene, None, scenes.SURFACES)
        assert xyz.shape == (12, 16, 3) and xyz.dtype == coverage.dtype == np.float32
        assert not xyz.any() and not coverage.any()


def test_a_light_below_the_horizon_gives_nothing(scenes, hardware, software):
    camera = Camera("top", (0, 3, 0.1), (0, 0, 0), vertical_fov_deg=30, width=16, height_px=16)
    scene = scenes.scene_of([(shapes.plane(4, 4), "gloss")], [scenes.sun((0.2, -0.5, 0.1))], camera)
    for renderer in (software, hardware):
        xyz, coverage = renderer.render(scene, None, scenes.SURFACES)
        assert not xyz.any() and (coverage == 1.0).all()


def test_the_back_of_an_open_surface_is_lit_like_its_front(scenes, brdfs, hardware, software):
    """Turned over, the cloth scatters alike: both sides follow the policy of the reference."""
    cloth = shapes.cloth(40)
    camera = Camera("below", (0.3, -2.5, 2.0), (0, 0.3, 0), vertical_fov_deg=40, width=48, height_px=48)
    scene = scenes.scene_of([(cloth, "gloss")], [scenes.sun((0.3, -0.8, 0.4))], camera)
    reference, _ = reference_image(scene, None, brdfs)
    assert reference.max() > 0.2
    for renderer in (software, hardware):
        xyz, _ = renderer.render(scene, None, scenes.SURFACES)
        assert np.percentile(difference(reference, xyz, scene), 99) < 0.5


def test_large_pictures_are_made_of_tiles(scenes, hardware, software, monkeypatch):
    scene = scenes.lamp_scene(size=40)
    whole, coverage = software.render(scene, None, scenes.SURFACES)
    monkeypatch.setattr("metamer.viewer.render.view.TILE_SAMPLES", 50)
    software.release()
    hardware.release()
    tiled, tiled_coverage = software.render(scene, None, scenes.SURFACES)
    theirs, their_coverage = hardware.render(scene, None, scenes.SURFACES)
    software.release()
    hardware.release()
    np.testing.assert_array_equal(tiled_coverage, their_coverage)
    assert difference(tiled, theirs, scene).max() < 0.1
    assert np.abs(coverage - tiled_coverage).max() <= 1.01 / 9
    assert np.percentile(difference(whole, tiled, scene), 99) < 0.05


def test_geometry_too_large_to_keep_is_worked_out_again(scenes, hardware, software, monkeypatch):
    scene = scenes.lamp_scene(size=24)
    for renderer in (software, hardware):
        renderer.release()
        kept, coverage = renderer.render(scene, None, scenes.SURFACES)
        renderer.release()
        monkeypatch.setattr("metamer.viewer.render.cache.KEPT_SAMPLES", 0)
        for _ in range(2):
            again, again_coverage = renderer.render(scene, None, scenes.SURFACES)
            assert not any(piece.tile for piece in renderer.cache.pieces)
            np.testing.assert_array_equal(kept, again)
            np.testing.assert_array_equal(coverage, again_coverage)
        monkeypatch.undo()


def test_geometry_is_kept_while_only_materials_change(scenes, software):
    scene = scenes.lamp_scene(size=16)
    software.render(scene, None, scenes.SURFACES)
    (kept,) = (piece.tile for piece in software.cache.pieces)
    software.render(scene.with_material("part0", "matt").with_illuminant(illuminant("A")), None, scenes.SURFACES)
    assert kept is not None and software.cache.pieces[0].tile is kept
    moved = scenes.lamp_scene(size=16)
    software.render(moved, None, scenes.SURFACES)
    assert software.cache.pieces[0].tile is not kept


def test_what_has_not_changed_is_taken_over(scenes):
    scene = scenes.lamp_scene(size=16)
    other = scenes.lamp_scene(size=17).camera()
    assert view_key(scene.camera()) != view_key(other)
    geometry = scene_geometry(scene)
    assert scene_geometry(scene.with_material("part0", "matt").with_illuminant(illuminant("A")), geometry) is geometry
    lights = (scenes.lamp((0, 2, 2)), scene.lights[1])
    moved = scene_geometry(scenes.scene_of([(p.mesh, "matt") for p in scene.parts], lights, other), geometry)
    assert moved.occluders is geometry.occluders and moved.lights[1] is geometry.lights[1]
    assert moved.lights[0] is not geometry.lights[0]
    assert scene_geometry(scenes.lamp_scene(size=16), geometry).occluders is not geometry.occluders


@pytest.mark.slow
def test_a_measured_mesh_of_88_000_triangles(scenes, hardware, software, brdfs, shared_data):
    from metamer.lighting.mesh.files import load_mesh

    mesh = load_mesh(shared_data / "meshes" / "shaderball.glb")
    low, high = mesh.bounds
    centre, radius = (low + high) / 2, np.linalg.norm(high - low) / 2
    camera = Camera(
        "c", centre + np.array([1.2, 1.5, 3.0]) * radius, centre, vertical_fov_deg=36, width=96, height_px=96
    )
    lamp = scenes.lamp(centre + np.array([-1.0, 1.5, 1.0]) * radius, 2000 * radius**2)
    scene = scenes.scene_of([(mesh, "gloss")], [scenes.sun(), lamp], camera)
    mine, coverage = software.render(scene, None, scenes.SURFACES)
    theirs, their_coverage = hardware.render(scene, None, scenes.SURFACES)
    np.testing.assert_array_equal(coverage, their_coverage)
    delta = difference(mine, theirs, scene)
    assert delta.max() < 0.1, worst(delta, mine, theirs)
    reference, _ = reference_image(scene, None, brdfs)
    assert np.percentile(difference(reference, mine, scene)[coverage > 0], 99) < 1.0


def test_a_missing_material_is_named(scenes, software):
    with pytest.raises(UnknownNameError, match="part part0"):
        software.render(scenes.sphere_scene("glos", size=8), None, scenes.SURFACES)


@pytest.mark.slow
def test_forty_lights_are_one_as_strong(scenes, hardware, software):
    scene = scenes.lamp_scene(size=16)
    parts = [(part.mesh, part.material) for part in scene.parts]
    lamp = scene.lights[0]
    weak = [replace(lamp, intensity_cd=lamp.intensity_cd / 40)] * 40
    crowd = replace(scene, lights=tuple(weak))
    one = replace(scene, lights=(lamp,))
    for renderer in (hardware, software):
        alone, _ = renderer.render(one, None, scenes.SURFACES)
        together, _ = renderer.render(crowd, None, scenes.SURFACES)
        np.testing.assert_allclose(together, alone, rtol=2e-5, atol=1e-6)
    assert len(parts) == len(crowd.parts)


def test_other_spectra_are_folded_from_kept_terms(scenes, hardware, software, monkeypatch):
    scene = scenes.lamp_scene(size=24)
    warm = (illuminant("A"),)
    for renderer in (hardware, software):
        renderer.configure(keeps_terms=True)
        (first,) = renderer.render_many(scene, None, scenes.SURFACES, warm)
        renderer.release()
        renderer.render(scene, None, scenes.SURFACES)
        with monkeypatch.context() as patched:
            patched.setattr(renderer.backend, "terms", lambda *_: pytest.fail("terms were worked out again"))
            (again,) = renderer.render_many(scene, None, scenes.SURFACES, warm)
        np.testing.assert_array_equal(again[0], first[0])
        # Lights of one spectrum are one sum.
        alike, _ = renderer.render(scene.with_illuminant(*warm), None, scenes.SURFACES)
        np.testing.assert_allclose(alike, first[0], rtol=1e-5, atol=1e-7)
        monkeypatch.setattr("metamer.viewer.render.cache.KEPT_TERMS", 0)
        renderer.release()
        (unkept,) = renderer.render_many(scene, None, scenes.SURFACES, warm)
        assert not renderer.cache.terms_bytes and not renderer.cache.pieces[0].terms
        np.testing.assert_array_equal(unkept[0], first[0])
        monkeypatch.undo()
        renderer.configure(keeps_terms=False)
        renderer.release()


def test_a_call_that_breaks_off_keeps_no_half_picture(scenes, software, monkeypatch):
    monkeypatch.setattr("metamer.viewer.render.view.TILE_SAMPLES", 30)
    software.release()
    scene = scenes.sphere_scene(size=24)
    turns = software.windows(scene, scene.camera())
    next(turns).worked_out()
    turns.close()
    assert not any(piece.tile for piece in software.cache.pieces)
    _, coverage = software.render(scene, None, scenes.SURFACES)
    pieces = software.cache.pieces
    assert all(piece.tile for piece in pieces) and len(pieces) > 1 and coverage[12, 12] == 1.0
    software.release()


def test_gl_objects_are_given_back(scenes, gl):
    renderer = gl_session(gl)
    scene = scenes.sphere_scene(size=16)
    renderer.render(scene, None, scenes.SURFACES)
    (tile,) = (piece.tile for piece in renderer.cache.pieces)
    textures = [tile.seen, *tile.lights[0]]
    renderer.close()
    assert all(type(texture.mglo).__name__ == "InvalidObject" for texture in textures)


def test_without_gl_the_numpy_renderer_says_why(monkeypatch):
    monkeypatch.setenv("METAMER_NO_GL", "1")
    renderer, reason = create_session()
    assert renderer.name == "software (numpy)" and "METAMER_NO_GL" in str(reason)


def test_with_gl_the_renderer_names_the_device(gl):
    renderer = gl_session(gl)
    assert renderer.name.startswith("OpenGL 4.")
    renderer.close()
