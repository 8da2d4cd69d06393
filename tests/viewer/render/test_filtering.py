"""Factors in half precision and mip-mapped: the same pictures in GL and numpy, and nearer to many samples a pixel."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.benchmarks import filtering as benchmark
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.materials.core.axes import Axis
from metamer.materials.factored.pack import FactoredBrdf, FactorPack
from metamer.materials.fitting.half_precision import rounded_to_half
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.palette import Palette
from metamer.viewer.gl.backend import create_session, gl_session
from metamer.viewer.gl.resources import Owner
from metamer.viewer.software.backend import software_session

SCENES = {
    "sphere": lambda scenes: scenes.sphere_scene("sharp", size=40),
    "sphere of a few pixels": lambda scenes: scenes.sphere_scene("sharp", size=12, samples=1),
    "anisotropic sphere of a few pixels": lambda scenes: scenes.sphere_scene("brushed", size=12, samples=1),
    "anisotropic, io, cloth with uv": lambda scenes: scenes.cloth_scene("woven", size=40, samples=1),
    "cloth with shadows, perspective": lambda scenes: scenes.cloth_scene(size=40),
    "lamp, sun and three parts": lambda scenes: scenes.lamp_scene(size=40, samples=1),
    "a far lamp": lambda scenes: scenes.far_lamp_scene(size=40),
    "plane to its horizon": lambda scenes: plane_to_its_horizon(scenes),
    "triangles far smaller than a sample": lambda scenes: fine_ball(scenes),
}


def plane_to_its_horizon(scenes):
    camera = Camera("low", (0, 1, 0), (0, 0.6, -4), vertical_fov_deg=60, width=40, height_px=40, samples=1)
    lights = [scenes.sun((0.1, 0.3, -1)), scenes.lamp((0, 2, -3))]
    return scenes.scene_of([(shapes.plane(400, 400), "brushed")], lights, camera)


def fine_ball(scenes):
    """20 480 triangles in a hundred pixels."""
    camera = scenes.sphere_scene(size=12, samples=1).camera()
    return scenes.scene_of([(shapes.sphere(5), "sharp")], [scenes.sun()], camera)


@pytest.fixture(scope="module")
def hardware(gl):
    renderer = gl_session(gl, "mipmapped")
    yield renderer
    renderer.close()


@pytest.fixture(scope="module")
def software():
    return software_session("mipmapped")


@pytest.fixture(scope="module")
def halved(scenes):
    return {
        name: FactoredBrdf(tuple(rounded_to_half(pack) for pack in one.packs)) for name, one in scenes.SURFACES.items()
    }


def difference(reference, sample, scene):
    pair = (np.asarray(picture, dtype=float) for picture in (reference, sample))
    return delta_e_xyz(*pair, scene.adopted_white(), method="CIE 1994")


def as_single(surfaces):
    """The same numbers, uploaded as float32."""
    return {name: FactoredBrdf(tuple(map(single, one.packs))) for name, one in surfaces.items()}


def single(pack):
    return replace(pack, precision="single")


@pytest.mark.parametrize(
    ("name", "precision"),
    [*((name, "single") for name in SCENES), ("sphere of a few pixels", "half"), ("a far lamp", "half")],
)
def test_mip_mapped_gl_equals_numpy_over_all_pixels(scenes, hardware, software, halved, name, precision):
    scene, packs = SCENES[name](scenes), halved if precision == "half" else scenes.SURFACES
    mine, coverage = software.render(scene, None, packs)
    theirs, their_coverage = hardware.render(scene, None, packs)
    np.testing.assert_array_equal(coverage, their_coverage)
    seen = coverage > 0
    assert seen.mean() > 0.05
    relative = np.abs(mine - theirs)[seen] / np.maximum(np.abs(mine[seen]), 1e-6)
    assert np.percentile(relative, 99.9) < 1e-3
    delta = difference(mine, theirs, scene)
    assert delta.max() < 0.1, np.unravel_index(delta.argmax(), delta.shape)


@pytest.mark.slow
def test_a_measured_mesh_mip_mapped(scenes, hardware, software, shared_data):
    from metamer.lighting.mesh.files import load_mesh

    mesh = load_mesh(shared_data / "meshes" / "shaderball.glb")
    low, high = mesh.bounds
    centre, radius = (low + high) / 2, np.linalg.norm(high - low) / 2
    eye = centre + np.array([1.2, 1.5, 3.0]) * radius
    camera = Camera("c", eye, centre, vertical_fov_deg=36, width=48, height_px=48, samples=1)
    scene = scenes.scene_of([(mesh, "gloss")], [scenes.sun()], camera)
    mine, coverage = software.render(scene, None, scenes.SURFACES)
    theirs, their_coverage = hardware.render(scene, None, scenes.SURFACES)
    np.testing.assert_array_equal(coverage, their_coverage)
    assert difference(mine, theirs, scene).max() < 0.1


@pytest.mark.slow_cases("sharp-mipmapped", "brushed-mipmapped")
@pytest.mark.parametrize("filtering", ["linear", "mipmapped"])
@pytest.mark.parametrize("material", ["sharp", "brushed", "woven"])
def test_half_precision_textures_give_the_float32_picture_bit_for_bit(scenes, gl, halved, material, filtering):
    scene = scenes.lamp_scene(material, size=32, samples=1)
    renderer = gl_session(gl, filtering)
    small, _ = renderer.render(scene, None, halved)
    large, _ = renderer.render(scene, None, as_single(halved))
    renderer.close()
    assert large.max() > 0.1
    if filtering == "linear":
        np.testing.assert_array_equal(small, large)
    else:  # the means of a single pack are not rounded
        assert 0.0 < difference(large, small, scene).max() < 0.2


def test_half_precision_takes_half_the_bytes(gl, halved):
    for surface in halved.values():
        for pack in surface.packs:
            owner = Owner(gl)
            half, whole = (one.shader().textures["factors"] for one in (pack, single(pack)))
            assert owner.texels(half).dtype == "f2" and owner.texels(whole).dtype == "f4"
            owner.release()
            assert 2 * half.nbytes == whole.nbytes == 16 * np.prod(whole.shape[:2])
            assert 3 < pack.shader(filtered=True).textures["factors"].nbytes / half.nbytes < 8
            np.testing.assert_array_equal(half.astype(np.float32), whole)


def test_subnormal_halves_are_not_flushed(scenes, gl):
    """A factor of 2^-24 to 2^-14, undone by its spectrum."""
    (pack,) = scenes.SURFACES["matt"].packs
    tiny = (pack.factors[0] * 2.0**-14).astype(np.float16).astype(float)
    assert 0.0 < tiny[tiny > 0].min() < tiny.max() < 2.0**-14
    brighter = pack.recoloured(pack.palette.values[0] * 2.0**14)
    small = FactoredBrdf((replace(brighter, factors=(tiny, *pack.factors[1:]), precision="half"),))
    scene = scenes.sphere_scene("matt", size=24, samples=1)
    with gl_session(gl) as renderer:
        found, _ = renderer.render(scene, None, {"matt": small})
        expected, _ = renderer.render(scene, None, as_single({"matt": small}))
    assert found.max() > 0.1
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("exponent", [1.0, 100.0, 1e4, 1e5])
def test_highlights_of_any_height_fit_into_16_bits(scenes, gl, exponent):
    """The peak of a normalised lobe grows with its exponent; the largest finite half is 65504."""
    last = min(np.pi / 2, np.arccos(1e-7 ** (1.0 / exponent)))
    axes = (Axis("theta_h", 128, last, "sqrt"), Axis("theta_d", 2, np.pi / 2), Axis("phi_d", 2, np.pi))
    lobe = (exponent + 1.0) / (2.0 * np.pi) * np.maximum(np.cos(axes[0].nodes), 0.0) ** exponent
    lobe[-1] = 0.0  # held beyond the axis
    factors = (lobe[:, None] * 100.0, np.ones((2, 1)), np.ones((2, 1)))
    pack = FactorPack("hd", axes, factors, Palette.of(scenes.spectrum(1)[None] / 100.0))
    small = rounded_to_half(pack)
    scene = scenes.sphere_scene("lobe", size=48, samples=1)
    for renderer in (gl_session(gl), gl_session(gl, "mipmapped"), software_session("mipmapped")):
        xyz, _ = renderer.render(scene, None, {"lobe": FactoredBrdf((small,))})
        expected, _ = renderer.render(scene, None, {"lobe": FactoredBrdf((pack,))})
        renderer.close()
        assert np.isfinite(xyz).all()
        assert np.percentile(difference(expected, xyz, scene), 99) < 0.1


def test_factors_that_16_bits_do_not_hold_are_refused(scenes, gl):
    (pack,) = scenes.SURFACES["matt"].packs
    for factor in (pack.factors[0], pack.factors[0] * 1e6):
        wrong = replace(pack, factors=(factor, *pack.factors[1:]), precision="half")
        with gl_session(gl) as renderer, pytest.raises(InputError, match="16 bits"):
            renderer.render(scenes.sphere_scene("matt", size=8), None, {"matt": FactoredBrdf((wrong,))})


@pytest.mark.parametrize("material", ["gloss", "brushed"])
def test_mip_mapped_is_nearer_to_many_samples_a_pixel(scenes, software, material):
    scene = scenes.sphere_scene(material, size=16, samples=1)
    camera = scene.camera()
    with software_session() as linear:
        truth, whole = linear.render(scene, replace(camera, samples=16), scenes.SURFACES)
        plain, _ = linear.render(scene, camera, scenes.SURFACES)
    averaged, _ = software.render(scene, camera, scenes.SURFACES)
    inside = whole == 1.0
    before, after = (difference(truth, picture, scene)[inside] for picture in (plain, averaged))
    assert np.percentile(after, 99) < 0.5 * np.percentile(before, 99)
    assert after.mean() < 0.6 * before.mean()


def test_a_highlight_smaller_than_a_pixel_keeps_its_light(scenes, software):
    """Wherever in a pixel it falls, its light is what many samples find: it neither sparkles nor goes out."""
    scene = scenes.sphere_scene("sharp", size=14, samples=1)
    camera = scene.camera()
    linear = software_session()
    found = {"plain": [], "averaged": [], "truth": []}
    for shift in np.linspace(-0.08, 0.08, 7):
        moved = replace(camera, position=(shift, 0.7 * shift, 4.0), target=(shift, 0.7 * shift, 0.0))
        views = (linear, moved), (software, moved), (linear, replace(moved, samples=12))
        for values, (renderer, view) in zip(found.values(), views, strict=True):
            around_the_highlight = renderer.render(scene, view, scenes.SURFACES)[0][2:8, 5:12, 1]
            values.append(around_the_highlight.sum())
    plain, averaged, truth = (np.array(values) for values in found.values())
    assert np.ptp(plain) > 0.5 * truth.mean()
    assert np.ptp(averaged) < 0.25 * np.ptp(plain)
    assert np.abs(averaged - truth).max() < 0.15 * truth.mean()


def test_linear_pictures_carry_no_spans(scenes, gl):
    with gl_session(gl) as renderer:
        renderer.render(scenes.sphere_scene(size=8), None, scenes.SURFACES)
        (tile,) = (piece.tile for piece in renderer.cache.pieces)
        assert [len(textures) for textures in tile.lights] == [3]
        assert "levels" not in scenes.SURFACES["matt"].packs[0].shader().uniforms
        renderer.configure(filtering="mipmapped")
        assert not renderer.cache.pieces
        renderer.render(scenes.sphere_scene(size=8), None, scenes.SURFACES)
        (tile,) = (piece.tile for piece in renderer.cache.pieces)
        assert [len(textures) for textures in tile.lights] == [5]
        renderer.configure(filtering="mipmapped")
        assert renderer.cache.pieces
        assert renderer.made_by == f"{renderer.name}, mipmapped factors"


def test_an_unknown_filtering_is_named():
    with pytest.raises(UnknownNameError, match="linear, mipmapped"):
        software_session().configure(filtering="trilinear")
    renderer, _ = create_session("mipmapped")
    assert renderer.settings.filtering == "mipmapped"
    renderer.close()


@pytest.mark.slow
def test_the_benchmark_says_what_filtering_costs_and_gains(software, monkeypatch):
    monkeypatch.setattr(benchmark, "CONFIGURATIONS", ((1, "linear"), (1, "mipmapped")))
    monkeypatch.setattr(benchmark, "SURFACES", {"gloss": (200.0, 200.0)})
    monkeypatch.setattr(benchmark, "RANK", 2)
    said = []
    points = benchmark.filtering_points(software, said.append, balls=2)
    assert software.settings.filtering == "mipmapped"
    assert len(points) == len(said) == 2
    assert {point["kind"] for point in points} == {"filtering"}
    plain, averaged = points
    assert (plain["configuration"], averaged["configuration"]) == ("1x1 samples, linear", "1x1 samples, mipmapped")
    assert set(plain["delta_e94"]) == {"mean", "p95", "p99", "max"}
    assert averaged["delta_e94"]["p99"] < plain["delta_e94"]["p99"]
    assert 0.0 < plain["ms_per_megapixel"] < plain["geometry_ms_per_megapixel"]
