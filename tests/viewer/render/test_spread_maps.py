"""Surfaces of maps in light from all around: both renderers, beside sums over every texel of a sky and other forms."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.environment import latlong
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.environment.prefiltering import GatheredLight
from metamer.lighting.mesh import shapes
from metamer.lighting.visibility import refinement
from metamer.materials.core.directions import spherical
from metamer.materials.core.points import Points
from metamer.materials.slices.fit import view_slices
from metamer.materials.svbrdf import facet_slices as slices_module
from metamer.materials.svbrdf.facet_slices import facet_slices
from metamer.materials.svbrdf.facets import facets, spread_of
from metamer.materials.svbrdf.map_set import Placement
from metamer.materials.svbrdf.maps import MappedSurface
from metamer.materials.svbrdf.stretched import axes_of, parts_of, sent_on
from metamer.materials.svbrdf.texel_map import TexelMap
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM
from metamer.viewer.gl.backend import gl_session
from metamer.viewer.render.surfaces import surface_samples
from metamer.viewer.software.backend import software_session

SPECTRA = tuple(illuminant(name) for name in ("D65", "A"))
ALIKE = TexelMap.constant
OBSERVER = observer("1931_2")


def sky(fields=1, **settings):
    """Clouds, a bright patch, and less from below."""
    to = latlong.texel_directions(32, 64)
    made = []
    for number in range(fields):
        axis = np.array([np.sin(number + 0.5), 0.6, np.cos(number + 0.5)])
        patch = np.exp(20.0 * (to @ (axis / np.linalg.norm(axis)) - 1.0))
        made.append(1.0 + 0.5 * np.sin(3.0 * to[..., 0] + number) + 3.0 * patch + 0.5 * to[..., 1])
    return EnvironmentLight(np.array(made), SPECTRA[:fields], **settings)


# Renderers keep what they make of a light, and geometry, as long as it is the same one.
ONE, TWO = sky(rotation_deg=-40.0), sky(2, rotation_deg=-40.0)
BALL = shapes.sphere(4, uv=True)


@pytest.fixture(scope="module")
def software():
    """Make sessions in numpy, by filtering."""
    return {filtering: software_session(filtering) for filtering in ("linear", "mipmapped")}


@pytest.fixture(scope="module")
def hardware(gl):
    """Make sessions on the GPU, by filtering."""
    return {filtering: gl_session(gl, filtering) for filtering in ("linear", "mipmapped")}


def surface_of(roughness=0.5, metal=0.0, **others):
    base = others.pop("base", ALIKE(0.7, 0.35, 0.15))
    made = ALIKE(roughness) if isinstance(roughness, float) else TexelMap(np.asarray(roughness, dtype=np.float32))
    metallic = ALIKE(metal) if isinstance(metal, float) else metal
    return MappedSurface(WORKING_WAVELENGTHS_NM, base, made, "mallett-yuksel", metallic=metallic, **others)


def waves(depth, height=32, width=48):
    """Smooth bumps."""
    y, x = np.mgrid[0:height, 0:width] * 2 * np.pi / 16
    lean = [depth * np.sin(x), depth * np.cos(y), np.ones_like(x)]
    return TexelMap(np.stack(lean, axis=-1).astype(np.float32))


def varied(**others):
    """Bumps, colours, metal and roughness that all differ, and holes."""
    rng = np.random.default_rng(5)
    colours = rng.integers(30, 255, (32, 48, 3)).astype(np.uint8)
    metal = TexelMap((rng.uniform(size=(32, 48, 1)) > 0.6).astype(np.uint8) * np.uint8(255))
    there = TexelMap((rng.uniform(size=(32, 48, 1)) > 0.1).astype(np.uint8) * np.uint8(255))
    given = {"base": TexelMap(colours, srgb=True), "normal": waves(0.3), "coverage": there, "cutoff": 0.5}
    return surface_of(rng.uniform(0.45, 0.8, (32, 48, 1)), metal, **(given | others))


def coated(**others):
    """All that under a coat that runs thin, of other bumps and roughness."""
    rng = np.random.default_rng(8)
    given = {"coat": TexelMap(rng.uniform(0.0, 1.0, (32, 48, 1)).astype(np.float32)), "coat_normal": waves(0.15)}
    given["coat_roughness"] = TexelMap(rng.uniform(0.3, 0.5, (32, 48, 1)).astype(np.float32))
    return varied(**(given | others))


def scene_of(scenes, light, size=12, samples=1):
    scene = scenes.scene_of([(BALL, "cloth")], [light], scenes.sphere_scene().camera())
    return replace(scene, cameras=(replace(scene.camera(), width=size, height_px=size, samples=samples),))


def summed(renderer, form, light):
    """XYZ of the picture that a renderer has drawn last: f_r cos(theta_i) times every texel of the sky."""
    height, width = light.fields.shape[1:]
    to = light.world_from_map @ latlong.texel_directions(height, width).reshape(-1, 3).T
    weight = light.fields.reshape(len(light.fields), -1) * np.repeat(latlong.solid_angles(height, width), width)
    (piece,) = renderer.cache.pieces
    view = renderer.cache.view
    surface = surface_samples(view, piece.window, view.triangles(piece.window), True)
    found = {}
    for pixel, frame, eye, uv in zip(surface.pixel, surface.frame, surface.to_viewer, surface.uv, strict=True):
        wi = (frame @ to).T
        wi, power = wi[wi[:, 2] > 0.0], weight[:, wi[:, 2] > 0.0]
        shaded = form.shaded(Points(wi, np.broadcast_to(frame @ eye, wi.shape), np.broadcast_to(uv, (len(wi), 2))))
        found[int(pixel)] = sum(
            np.pi / 1000.0 * OBSERVER.weights(spectrum, WORKING_WAVELENGTHS_NM) @ (one @ shaded)
            for spectrum, one in zip(light.spectra, power, strict=True)
        )
    return np.array(list(found)), np.array(list(found.values()))


def off(scenes, software, surface, light=TWO):
    form, renderer = surface.own_form(0.05), software["linear"]
    scene = scene_of(scenes, light)
    drawn, _ = renderer.render(scene, None, {"cloth": form})
    pixels, found = summed(renderer, form, light)
    return delta_e_xyz(found, drawn.reshape(-1, 3)[pixels].astype(float), scene.adopted_white())


@pytest.mark.slow_cases(
    "alike everywhere-linear",
    "alike everywhere-mipmapped",
    "two axes alike-linear",
    "coated-mipmapped",
    "two axes alike-mipmapped",
)
@pytest.mark.slow_cases(
    *(f"{kind}-{how}" for kind in ("varied", "two axes, turned", "coated, two axes") for how in ("linear", "mipmapped"))
)
@pytest.mark.parametrize("filtering", ["linear", "mipmapped"])
@pytest.mark.parametrize(
    "kind", ["varied", "two axes, turned", "alike everywhere", "two axes alike", "coated", "coated, two axes"]
)
def test_gl_equals_numpy(scenes, software, hardware, filtering, kind):
    if kind == "varied":
        surface = varied(placement=Placement((3.0, 2.0), (-0.7, 0.2), ("repeat", "mirror")))
    elif kind == "coated":
        surface = coated()
    elif kind == "coated, two axes":
        surface = surface_of(np.broadcast_to([0.6, 0.4], (2, 2, 2)), 1.0, coat=ALIKE(0.8), coat_roughness=ALIKE(0.3))
    elif kind == "alike everywhere":
        surface = surface_of(0.5)
    elif kind == "two axes alike":
        surface = surface_of(np.broadcast_to([0.6, 0.4], (1, 1, 2)), 1.0, turn=ALIKE(0.4))
    else:
        rng = np.random.default_rng(1)
        turn = TexelMap(rng.uniform(0.0, 3.0, (32, 48, 1)).astype(np.float32))
        surface = surface_of(rng.uniform(0.4, 0.8, (32, 48, 2)), 1.0, normal=waves(0.3), turn=turn)
    scene = scene_of(scenes, TWO, size=16, samples=2)
    # Single precision, and half.
    for budget in (1e-3, 0.5) if kind == "varied" else (1e-3,):
        form = surface.own_form(budget)
        twin, coverage = software[filtering].render(scene, None, {"cloth": form})
        drawn, _ = hardware[filtering].render(scene, None, {"cloth": form})
        some = np.abs(twin[coverage > 0.0])
        relative = np.abs(drawn - twin)[coverage > 0.0] / np.maximum(some, 1e-2 * some.max())
        assert np.percentile(relative, 99.9) < 1e-3
        seen = coverage == 1.0
        white = scene.adopted_white()
        assert delta_e_xyz(twin[seen].astype(float), drawn[seen].astype(float), white).max() < 0.1


@pytest.mark.slow
def test_gl_equals_numpy_where_something_stands_in_the_way(scenes, software, hardware, monkeypatch):
    monkeypatch.setattr(refinement, "MOST_VERTICES", 400)
    parts = [(shapes.sphere(3, uv=True), "cloth"), (shapes.plane(4.0, 4.0).placed(translate=(0, -0.9, 0)), "cloth")]
    camera = replace(scenes.sphere_scene().camera(), width=20, height_px=20, samples=1)
    scene, form = scenes.scene_of(parts, [ONE], camera), {"cloth": varied().own_form(1e-3)}
    twin, coverage = software["linear"].render(scene, None, form)
    drawn, _ = hardware["linear"].render(scene, None, form)
    seen = coverage == 1.0
    off = delta_e_xyz(twin[seen].astype(float), drawn[seen].astype(float), scene.adopted_white())
    assert seen.sum() > 100 and off.max() < 0.1


@pytest.mark.parametrize("metal", [0.0, 1.0])
@pytest.mark.parametrize("roughness", [0.3, 0.7])
def test_pictures_are_sums_over_every_texel(scenes, software, roughness, metal):
    found = off(scenes, software, surface_of(roughness, metal))
    assert found.mean() < 0.2 and found.max() < 0.7


@pytest.mark.parametrize("metal", [0.0, 1.0])
def test_bumps_gather_what_their_own_normals_face(scenes, software, metal):
    # Leaning by up to 30 degrees, which the mesh's own horizon cuts.
    found = off(scenes, software, surface_of(0.5, metal, normal=waves(0.4)))
    assert found.mean() < 0.5 and found.max() < 1.5


def test_everything_at_once_is_the_sum_over_every_texel(scenes, software):
    found = off(scenes, software, varied(), ONE)
    assert found.mean() < 0.4 and found.max() < 1.2


@pytest.mark.parametrize("metal", [0.0, 1.0])
@pytest.mark.parametrize("roughness", [0.35, 0.6])
def test_a_coat_is_the_sum_over_every_texel(scenes, software, roughness, metal):
    lacquer = {"coat": ALIKE(1.0), "coat_roughness": ALIKE(roughness)}
    found = off(scenes, software, surface_of(0.6, metal, **lacquer))
    assert found.mean() < 0.12 and found.max() < 0.4


@pytest.mark.parametrize("metal", [0.0, 1.0])
def test_a_coat_lies_over_bumps(scenes, software, metal):
    lacquer = {"coat": ALIKE(1.0), "coat_roughness": ALIKE(0.3)}
    found = off(scenes, software, surface_of(0.5, metal, normal=waves(0.4), **lacquer))
    assert found.mean() < 0.4 and found.max() < 1.1


def test_a_coat_with_maps_of_its_own_is_the_sum_over_every_texel(scenes, software):
    found = off(scenes, software, coated(), ONE)
    assert found.mean() < 0.3 and found.max() < 0.9


@pytest.mark.parametrize(
    "rough, metal, turn, most", [((0.7, 0.5), 0.0, 0.0, 0.25), ((0.5, 0.7), 1.0, 0.0, 0.9), ((0.7, 0.3), 1.0, 0.7, 1.6)]
)
def test_highlights_of_two_axes_are_as_wide_along_each(scenes, software, rough, metal, turn, most):
    # As one width, that of the same area, metals were off by 2.0 and 4.8, and paint by 0.18.
    brushed = surface_of(np.broadcast_to(rough, (2, 2, 2)), metal, turn=ALIKE(turn))
    assert off(scenes, software, brushed, ONE).mean() < most


def test_what_facets_of_two_widths_send_on_depends_on_where_the_viewer_stands():
    """Beside sums over all directions: as the root of the mean square says it was off by up to 7 % at 75 degrees."""
    z, turn = np.meshgrid((np.arange(400) + 0.5) / 400, (np.arange(400) + 0.5) / 400 * 2 * np.pi)
    wi = spherical(np.arccos(z.ravel()), turn.ravel())

    def sums(alpha, wo):
        spread = np.broadcast_to([alpha[0] ** 2, 0.0, alpha[1] ** 2], wi.shape)
        return 2.0 * np.pi * np.mean(facets(wi, np.broadcast_to(wo, wi.shape), spread) * wi[:, 2])

    for wide, narrow in ((0.49, 0.25), (0.3, 0.12)):
        mean = np.hypot(wide, narrow) / np.sqrt(2.0)
        for theta, phi in ((0.3, 1.0), (1.0, 0.1), (1.0, 1.5), (1.31, 0.1), (1.31, 1.5)):
            wo = spherical(np.array([theta]), np.array([phi]))
            axis, alphas = np.array([[1.0, 0.0]]), [np.array([each]) for each in (wide, narrow, mean)]
            told = sent_on(*alphas[:2], axis, wo).sum() / sent_on(alphas[2], alphas[2], axis, wo).sum()
            true = sums((wide, narrow), wo[0]) / sums((mean, mean), wo[0])
            assert abs(told / true - 1.0) < 0.025, (wide, theta, phi)


def test_parts_that_lean_are_the_facets_themselves_where_both_widths_are_alike():
    rng = np.random.default_rng(3)
    spread = np.broadcast_to([0.09, 0.0, 0.09], (20, 3))
    normal, wo = (spherical(rng.uniform(0.0, 0.7, 20), rng.uniform(0.0, 6.0, 20)) for _ in range(2))
    normals, alphas, shares = parts_of(spread, normal, wo)
    np.testing.assert_allclose(normals, np.broadcast_to(normal[:, None], normals.shape), atol=1e-12)
    np.testing.assert_allclose(alphas, 0.3)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0)


def test_axes_of_a_turned_spread_are_those_that_were_turned():
    alpha, turn = np.array([[0.5, 0.02], [0.1, 0.4], [0.3, 0.3]]), np.array([0.4, 0.3, 0.2])
    wide, narrow, axis = axes_of(spread_of(alpha, turn))
    np.testing.assert_allclose(wide, alpha.max(axis=1), rtol=1e-12)
    np.testing.assert_allclose(narrow, alpha.min(axis=1), rtol=1e-9)
    # The second is wide across the direction that it is turned to.
    for got, angle in zip(axis[:2], (0.4, 0.3 + np.pi / 2), strict=True):
        assert abs(got @ [np.cos(angle), np.sin(angle)]) > 1.0 - 1e-12


def test_facets_of_two_widths_send_on_as_much_as_the_root_of_the_mean_square():
    (form,) = (surface_of(np.broadcast_to([0.7, 0.4], (2, 2, 2)), 1.0).own_form(0.05).environment_form(),)
    z, turn = np.meshgrid((np.arange(200) + 0.5) / 200, (np.arange(200) + 0.5) / 200 * 2 * np.pi)
    wi = spherical(np.arccos(z.ravel()), turn.ravel())
    spread = np.broadcast_to([0.49**2, 0.0, 0.16**2], wi.shape)
    for theta in (0.2, 0.8):
        (wo,) = spherical(np.array([theta]), np.array([0.6]))
        true = 2.0 * np.pi * np.mean(facets(wi, np.broadcast_to(wo, wi.shape), spread) * wi[:, 2])
        told = form._slices(False).energy(np.array([theta]), np.sqrt(spread[:1, [0, 2]].mean(axis=1)))[0, 2:].sum()
        assert abs(told / true - 1.0) < 0.02


def gathered(form, points, frame, light):
    """XYZ of points in one frame, out of a form's lobes."""
    lobes, from_light = form.lobes(points), GatheredLight.of(light)
    frames = np.broadcast_to(frame, (len(points), 3, 3))
    frames = (frames if lobes.frame is None else lobes.frame @ frames) @ light.world_from_map
    lux = from_light.by_frames(frames, lobes.matt.shape[1])[..., 0]
    seen = from_light.by_lobes(lobes.directions @ frames, lobes.sharpness)[..., 0]
    terms = np.einsum("nb,nbr->nr", lux / np.pi, lobes.matt) + np.einsum("nq,nqr->nr", seen, lobes.value)
    weights = OBSERVER.weights(light.spectra[0], form.palette.wavelengths_nm)
    return np.pi / 1000.0 * terms @ form.palette.samples[0] @ weights.T


@pytest.mark.slow_cases("0.7-0.0")
@pytest.mark.parametrize("roughness, metal", [(0.3, 1.0), (0.7, 0.0)])
def test_maps_that_are_alike_everywhere_are_the_uniform_material(roughness, metal):
    surface, light = surface_of(roughness, metal), ONE
    frame = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    wo = spherical(np.linspace(0.0, 1.5, 60), np.linspace(0.0, 40.0, 60))
    found, expected = (
        gathered(form, Points(wo, wo, np.zeros((60, 2))), frame, light)
        for form in (surface.own_form(0.05).environment_form(), view_slices(surface.average()))
    )
    assert delta_e_xyz(found, expected, OBSERVER.white(SPECTRA[0])).max() < 0.5


def test_between_two_alphas_slices_are_about_what_their_own_would_be():
    # A map of many widths beside one of a single width, which has its own slices.
    light, frame = ONE, np.eye(3)[[2, 0, 1]]
    wo = spherical(np.linspace(0.0, 1.4, 40), np.linspace(0.0, 40.0, 40))
    points = Points(wo, wo, np.full((40, 2), 0.25))
    widths = np.full((2, 2, 1), 0.55)
    widths[0] = 0.8
    many = surface_of(widths, 1.0).own_form(0.05).environment_form()
    one = surface_of(0.55, 1.0).own_form(0.05).environment_form()
    found, expected = (gathered(form, points, frame, light) for form in (many, one))
    assert many.lobes(points).sharpness.shape[1] == 2 * one.lobes(points).sharpness.shape[1]
    assert delta_e_xyz(found, expected, OBSERVER.white(SPECTRA[0])).max() < 1.5


def test_slices_are_shared_by_range():
    assert facet_slices(0.21, 0.5) is facet_slices(0.22, 0.6)
    assert len(facet_slices(0.3, 0.3).alphas) == 1


@pytest.mark.parametrize("wet", [False, True], ids=["bare", "coated"])
def test_slices_are_kept_bit_for_bit_by_alpha_coat_and_code(tmp_path, monkeypatch, wet):
    """As another process finds them."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    made, read = (each.__wrapped__(0.3, wet) for each in (slices_module._of_alpha,) * 2)
    for one, other in zip(made, read, strict=True):
        np.testing.assert_array_equal(one, other)
    slices_module._of_alpha.__wrapped__(0.3000001, wet)
    monkeypatch.setattr(slices_module, "_code", lambda: "another")
    slices_module._of_alpha.__wrapped__(0.3, wet)
    assert len(list((tmp_path / "metamer" / "facets").iterdir())) == 3


@pytest.mark.slow_cases("hardware-bare", "hardware-coated")
@pytest.mark.parametrize("made", [varied, coated], ids=["bare", "coated"])
@pytest.mark.parametrize("kind", ["software", "hardware"])
def test_far_away_means_are_nearer_to_many_samples(scenes, software, request, kind, made):
    """Some ten texels a sample."""
    surface = made(placement=Placement((12.0, 6.0), (0.0, 0.0), ("repeat", "repeat")))
    scene, form = scene_of(scenes, ONE, size=16), {"cloth": surface.own_form(0.05)}
    truth, whole = software["linear"].render(scene, replace(scene.camera(), samples=12), form)
    found = {}
    for filtering in ("linear", "mipmapped"):
        xyz, _ = request.getfixturevalue(kind)[filtering].render(scene, None, form)
        inside = whole == 1.0
        found[filtering] = delta_e_xyz(truth[inside].astype(float), xyz[inside].astype(float), scene.adopted_white())
    assert found["mipmapped"].mean() < 0.3 * found["linear"].mean(), {k: v.mean() for k, v in found.items()}


@pytest.mark.parametrize("made", [varied, coated], ids=["bare", "coated"])
def test_what_a_texture_is_from_afar_is_lit_too(scenes, software, hardware, made):
    form = made().own_form(0.05).average()
    scene = scene_of(scenes, ONE)
    one, _ = software["linear"].render(scene, None, {"cloth": form})
    other, _ = hardware["linear"].render(scene, None, {"cloth": form})
    assert np.abs(one - other).max() < 1e-3 * one.max()
