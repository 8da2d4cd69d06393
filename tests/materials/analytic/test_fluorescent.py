"""Fluorescent matt surfaces in pictures: folded packs against rays and the full matrix."""

import numpy as np
from metamer.lighting.camera import Camera
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.plan import plan_scene
from metamer.lighting.reference.reference import reference_image, reference_images
from metamer.lighting.scene import Part, Scene
from metamer.materials.analytic import Lambert
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.bispectral import fluorophore
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.folding import Folding
from metamer.spectral.formats.spectral_exr import read_spectral_exr
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum
from metamer.viewer.gl.backend import gl_session
from metamer.viewer.render.session import radiance_weights
from metamer.viewer.software.backend import software_session

EYE, NM = observer("1931_2"), np.arange(300.0, 781.0, 10.0)
D65 = illuminant("D65")
UV_FREE = Spectrum.sampled(
    np.arange(300.0, 831.0),
    np.where(np.arange(300.0, 831.0) <= 400, 0.0, D65.resampled(np.arange(300.0, 831.0)).samples),
    "emission",
)
LIGHTS = (D65, illuminant("A"), UV_FREE, illuminant("FL11"))
UP = np.array([0.0, 0.0, 1.0])


def dye(absorbed=480.0, sent=580.0):
    def bump(centre):
        return np.exp(-(((NM - centre) / 35.0) ** 2))

    base = Spectrum.sampled(NM, 0.1 + 0.3 * (NM > 560))
    return fluorophore(base, 0.6 * bump(absorbed), bump(sent), 0.9)


BRDF = FluorescentLambert(dye())


def ball(material="dye", light=D65):
    camera = Camera(projection="orthographic", width=32, height_px=32, samples=2)
    lamp = DirectionalLight((1.0, 1.0, 2.0), light, illuminance_lux=1000.0)
    return Scene((Part("ball", sphere(4), material),), (lamp,), (camera,), EYE)


def assert_same_pictures(truth, shown, tolerance=2e-5):
    worst = np.unravel_index(np.abs(truth - shown).argmax(), truth.shape)
    assert np.abs(truth - shown).max() < tolerance, (worst, truth[worst], shown[worst])


def test_facing_the_light_the_reference_is_the_fold():
    camera = Camera(
        position=(0, 6, 0), target=(0, 0, 0), up=(0, 0, -1), projection="orthographic", height=4, width=8, height_px=8
    )
    lamp = DirectionalLight((0, 1, 0), D65, illuminance_lux=1000.0)
    scene = Scene((Part("floor", plane(), "dye"),), (lamp,), (camera,), EYE)
    pictures = reference_images(scene, None, {"dye": BRDF}, LIGHTS)
    for light, xyz in zip(LIGHTS, pictures.xyz, strict=True):
        expected = np.broadcast_to(dye().fold(light, EYE), xyz.shape)
        np.testing.assert_allclose(xyz, expected, rtol=1e-6)


def test_rendered_pictures_are_the_reference():
    scene = ball()
    truth = reference_images(scene, None, {"dye": BRDF}, LIGHTS)
    with software_session() as renderer:
        shown = renderer.render_many(scene, None, {"dye": BRDF.own_form()}, LIGHTS)
    for number, light in enumerate(LIGHTS):
        xyz = shown[number][0]
        lit = truth.xyz[number][..., 1] > 0.02
        assert lit.sum() > 300
        difference = delta_e_xyz(truth.xyz[number][lit], xyz[lit].astype(np.float64), EYE.white(light))
        assert np.percentile(difference, 99) < 0.05, (number, difference.max())


def test_gl_agrees_with_numpy(gl):
    scene = ball()
    with software_session() as software, gl_session(gl) as renderer:
        theirs, _ = software.render(scene, None, {"dye": BRDF.own_form()})
        ours, _ = renderer.render(scene, None, {"dye": BRDF.own_form()})
    assert_same_pictures(theirs, ours)


def test_a_diagonal_matrix_is_lambert():
    plain = dye().without_emission()
    fluorescent, lambert = FluorescentLambert(plain), Lambert(plain.reflectance)
    wi = np.array([[0.0, 0.6, 0.8], [0.0, 0.0, 1.0], [0.0, 0.6, -0.8]])
    np.testing.assert_array_equal(fluorescent.eval(wi, UP), lambert.eval(wi, UP))
    np.testing.assert_array_equal(fluorescent.emission_factor(wi, UP), [1 / np.pi, 1 / np.pi, 0.0])
    scene = ball("m")
    ours, _ = reference_image(scene, None, {"m": fluorescent})
    theirs, _ = reference_image(scene, None, {"m": lambert})
    np.testing.assert_allclose(ours, theirs, rtol=1e-14)


def test_a_light_without_ultraviolet_shows_a_brightener_as_its_diagonal():
    brightener = FluorescentLambert(dye(330.0, 440.0))
    plain = FluorescentLambert(brightener.bispectral.without_emission())
    with software_session() as renderer:
        packs = {"b": brightener.own_form()}, {"b": plain.own_form()}
        dark = [renderer.render(ball("b", UV_FREE), None, each)[0] for each in packs]
        lit = [renderer.render(ball("b", D65), None, each)[0] for each in packs]
    # Absorption at 330 nm reaches, ever fainter, past 400 nm.
    assert_same_pictures(*dark, tolerance=2e-3)
    assert (lit[0] - lit[1])[..., 2].max() > 0.05


def test_projecting_into_a_basis_of_reflectances_leaves_it_alone():
    """A scene's plan projects every pack; this one is already three numbers a light."""
    (pack,) = BRDF.own_form().packs
    palette, folding = pack.palette, Folding(EYE, [D65])
    assert palette.in_basis(SpectralBasis.sampled()) is palette
    np.testing.assert_allclose(palette.folded(folding)[0, 0], dye().fold(D65, EYE))
    plan = plan_scene([BRDF.own_form()], [D65, illuminant("A")], EYE)
    assert pack.in_basis(plan.basis).palette.folded(folding).shape == (1, 1, 3)


def test_packs_are_exact_for_every_direction():
    rng = np.random.default_rng(3)
    wi, wo = rng.normal(size=(2, 500, 3))
    wi, wo = (np.abs(w) / np.linalg.norm(w, axis=1, keepdims=True) for w in (wi, wo))
    shaded = BRDF.own_form().packs[0].values(wi, wo)[:, 0]
    np.testing.assert_allclose(shaded, BRDF.emission_factor(wi, wo) * wi[:, 2], rtol=1e-12)


def test_spectral_pictures_show_light_where_the_lamp_has_none():
    grid = np.arange(380.0, 781.0, 10.0)
    blue = Spectrum.sampled(grid, np.where(grid < 520, 1.0, 0.0), "emission")
    scene = ball("dye", blue)
    with software_session() as renderer:
        spectra = renderer.render_spectra(scene, None, {"dye": BRDF.own_form()}, grid)
        xyz, _ = renderer.render(scene, None, {"dye": BRDF.own_form()})
    assert spectra[..., grid == 580].max() > 0.05 * spectra.max() and blue.samples[grid == 580] == 0
    seen = spectra.astype(np.float64) @ radiance_weights(EYE, grid).T
    np.testing.assert_allclose(seen, xyz, atol=0.01 * xyz.max())


def test_beside_an_ordinary_material_under_two_lights():
    lamps = tuple(DirectionalLight((x, 1.0, 2.0), light) for x, light in ((1.0, D65), (-1.0, illuminant("A"))))
    camera = Camera(position=(0, 0, 8), projection="orthographic", height=3, width=32, height_px=16, samples=2)
    parts = (Part("left", sphere(3), "dye"), Part("right", sphere(3).transformed(_shift(2.5)), "plain"))
    scene = Scene(parts, lamps, (camera,), EYE)
    plain = FluorescentLambert(dye().without_emission())
    truth, _ = reference_image(scene, None, {"dye": BRDF, "plain": Lambert(plain.bispectral.reflectance)})
    with software_session() as renderer:
        shown, _ = renderer.render(scene, None, {"dye": BRDF.own_form(), "plain": plain.own_form()})
    assert np.percentile(np.abs(truth - shown), 99) < 2e-3


def _shift(x):
    matrix = np.eye(4)
    matrix[0, 3] = x
    return matrix


def test_real_sticky_notes(shared_data):
    """Under D65, A and a light without ultraviolet: folded picture against rays and the full matrix."""
    image = read_spectral_exr(shared_data / "spectra" / "exr" / "BiSpectral.exr")
    found = {}
    for row, column in np.ndindex(16, 16):
        note = image.bispectral(row, column)
        found.setdefault(note.matrix.tobytes(), FluorescentLambert(note))
    assert len(found) == 2
    for brdf in found.values():
        truth = reference_images(ball("note"), None, {"note": brdf}, LIGHTS)
        with software_session() as renderer:
            shown = renderer.render_many(ball("note"), None, {"note": brdf.own_form()}, LIGHTS)
        for number, light in enumerate(LIGHTS):
            lit = truth.xyz[number][..., 1] > 0.02
            white = EYE.white(light)
            off = delta_e_xyz(truth.xyz[number][lit], shown[number][0][lit].astype(float), white)
            assert np.percentile(off, 99) < 0.05, (number, off.max())
            diagonal = brdf.bispectral.without_emission().fold(light, EYE)
            assert delta_e_xyz(brdf.bispectral.fold(light, EYE), diagonal, white) > 3
