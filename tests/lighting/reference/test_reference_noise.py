"""The noise of a reference under lights that spread: stated, kept to, and honest; and what lights do together."""

from dataclasses import dataclass

import numpy as np
import pytest
from metamer.lighting import scene as scenes
from metamer.lighting.camera import Camera
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.environment.softbox import SoftboxLight
from metamer.lighting.lights import DirectionalLight, SpreadLight
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.reference import direction_sampling, noise
from metamer.lighting.reference.geometry import visible_geometry
from metamer.lighting.reference.noise import draw_until_quiet
from metamer.lighting.reference.reference import reference_image, reference_images
from metamer.lighting.scene import Part, Scene
from metamer.materials.analytic import AshikhminShirley, Lambert
from metamer.runtime.errors import InputError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM as NM
from metamer.spectral.spectrum import Spectrum
from scipy.stats import qmc

OBSERVER = observer("1931_2")
D65, A, FL11 = (illuminant(name) for name in ("D65", "A", "FL11"))
RAMP = Spectrum.sampled(NM, np.linspace(0.1, 0.7, 81))
SURFACES = {"ramp": Lambert(RAMP), "gloss": AshikhminShirley(RAMP, RAMP, 60.0, 60.0)}
SKY = np.random.default_rng(8).random((4, 8)) ** 2
SUN = DirectionalLight((0.3, 0.8, 0.5), A, 700.0)


def moved(mesh, *by):
    matrix = np.eye(4)
    matrix[:3, 3] = by
    return mesh.transformed(matrix)


def scene_of(*lights, size=8, samples=2, gloss="gloss", floor=True):
    parts = (Part("floor", plane(6, 6), "ramp"), Part("ball", moved(sphere(4), 0, 1, 0), gloss))
    camera = Camera(position=(0.6, 2.2, 4.0), target=(0, 0.7, 0), width=size, height_px=size, samples=samples)
    return Scene(parts if floor else parts[1:], lights, (camera,), OBSERVER)


def sky(fields=SKY, spectra=(D65,), lux=1000.0):
    return EnvironmentLight(np.reshape(fields, (len(spectra), *np.shape(fields)[-2:])), spectra, lux)


def test_one_direction_stays_as_it_is_to_the_bit_and_has_no_noise():
    alone = reference_images(scene_of(SUN), None, SURFACES)
    geometry = visible_geometry(scene_of(SUN))
    assert alone.noise is None and geometry.frame is None and geometry.geometric is None
    together = visible_geometry(scene_of(SUN, sky()))
    for name in ("sample", "wi", "illuminance_lux"):
        np.testing.assert_array_equal(getattr(together.lit[0], name), getattr(geometry.lit[0], name))


def test_a_sun_and_a_sky_add_up():
    sun = reference_images(scene_of(SUN), None, SURFACES).xyz
    light = reference_images(scene_of(sky()), None, SURFACES, most_directions=64)
    both = reference_images(scene_of(SUN, sky()), None, SURFACES, most_directions=64)
    np.testing.assert_allclose(both.xyz, sun + light.xyz, rtol=1e-12, atol=1e-14)
    # Bright light without noise hides some.
    assert both.noise.mean[0] < light.noise.mean[0]


def test_two_spectra_are_the_sum_of_each_alone():
    fields = np.stack([SKY, SKY[:, ::-1] * 0.5])
    light = sky(fields, (D65, A))
    both = reference_images(scene_of(light), None, SURFACES, most_directions=512)
    apart = []
    for one, spectrum in zip(light.fields, light.spectra, strict=True):
        lux = EnvironmentLight._relative_illuminances(one[None]).sum()
        apart.append(reference_images(scene_of(sky(one, (spectrum,), lux)), None, SURFACES, most_directions=512))
    white = scene_of(light).adopted_white()
    off = delta_e_xyz(apart[0].xyz[0] + apart[1].xyz[0], both.xyz[0], white)
    assert off[both.coverage == 1].mean() < 2 * (both.noise.mean[0] + apart[0].noise.mean[0])


def test_an_illuminant_takes_the_place_of_all_spectra():
    light = sky(np.stack([SKY, SKY[:, ::-1]]), (D65, A))
    pictures = reference_images(scene_of(light), None, SURFACES, (None, FL11, A), most_directions=128)
    assert len(pictures.noise.mean) == len(pictures.noise.p99) == 3
    replaced = scene_of(light).with_illuminant(FL11)
    np.testing.assert_allclose(
        pictures.xyz[1], reference_images(replaced, None, SURFACES, most_directions=128).xyz[0], rtol=1e-9, atol=1e-12
    )


BOX = SoftboxLight((1.0, 3.0, 1.0), (0.0, 1.0, 0.0), 1.0, 0.5, FL11, 300.0)


def test_whites_under_other_spectra_are_those_of_the_scene_so_lit_and_its_lights_are_weighed_once(monkeypatch):
    light = sky(np.stack([SKY, SKY[:, ::-1]]), (D65, A))
    scene, counted = scene_of(SUN, BOX, light), []
    one_by_one = [scene if one is None else scene.with_illuminant(one) for one in (None, FL11, A, D65)]
    expected = np.stack([one.adopted_white() for one in one_by_one])
    fresh = scene_of(SUN, BOX, light)
    weigh = scenes.illuminances_lux
    monkeypatch.setattr(scenes, "illuminances_lux", lambda *given: counted.append(given) or weigh(*given))
    assert np.array_equal(fresh.adopted_whites((None, FL11, A, D65)), expected) and len(counted) == 1


def test_a_reference_under_many_spectra_makes_no_scene_of_each(monkeypatch):
    scene = scene_of(BOX, size=4)
    apart = reference_images(scene, None, SURFACES, (FL11,), most_directions=16)
    monkeypatch.setattr(Scene, "with_illuminant", None)
    pictures = reference_images(scene, None, SURFACES, (A, FL11, D65), most_directions=16)
    np.testing.assert_allclose(pictures.xyz[1], apart.xyz[0], rtol=1e-12)


def test_noise_of_all_pictures_is_told_at_once_and_is_that_of_each(monkeypatch):
    rng, compared = np.random.default_rng(3), []
    halves, beside = rng.random((2, 3, 4, 5, 3)), rng.random((3, 4, 5, 3))
    judged, whites = rng.random((4, 5)) > 0.3, rng.random((3, 3)) + 0.5
    mean = halves.mean(axis=0) + beside
    expected = [
        delta_e_xyz(mean[one][judged], (halves[0] + beside)[one][judged], whites[one]) for one in range(len(whites))
    ]
    monkeypatch.setattr(noise, "delta_e_xyz", lambda *given: compared.append(given) or delta_e_xyz(*given))
    found = noise.noise_of(halves, beside, judged, whites)
    assert len(compared) == 1 and found.flags.c_contiguous
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    with pytest.raises(InputError, match="white"):
        noise.noise_of(halves, beside, judged, whites * [[1], [1], [0]])


def test_points_of_the_sequence_are_made_once(monkeypatch):
    made, sobol = [], qmc.Sobol
    direction_sampling._sobol.cache_clear()
    monkeypatch.setattr(qmc, "Sobol", lambda *given, **more: made.append(given) or sobol(*given, **more))
    for _ in range(2):
        reference_images(scene_of(BOX, size=4), None, SURFACES, most_directions=16)
    assert len(made) == 1


def test_equal_seeds_are_equal_pictures_and_others_differ_by_the_noise():
    scene = scene_of(sky())
    first, again = (reference_images(scene, None, SURFACES, most_directions=256) for _ in range(2))
    other = reference_images(scene, None, SURFACES, most_directions=256, seed=7)
    np.testing.assert_array_equal(first.xyz, again.xyz)
    assert first.noise == again.noise
    off = delta_e_xyz(first.xyz[0], other.xyz[0], scene.adopted_white())[first.coverage == 1].mean()
    stated = np.hypot(first.noise.mean[0], other.noise.mean[0])
    assert 0.5 * stated < off < 2.0 * stated


def test_geometry_that_is_kept_and_bands_give_the_same_within_the_noise():
    scene = scene_of(sky())
    geometry = visible_geometry(scene)
    assert geometry.frame is not None
    whole = reference_images(scene, None, SURFACES, most_directions=256)
    kept = reference_images(scene, None, SURFACES, most_directions=256, geometry=geometry)
    np.testing.assert_array_equal(whole.xyz, kept.xyz)
    bands = reference_images(scene, None, SURFACES, most_directions=256, band_samples=8 * 4 * 3)
    off = delta_e_xyz(whole.xyz[0], bands.xyz[0], scene.adopted_white())[whole.coverage == 1]
    assert 0 < off.mean() < 2.5 * whole.noise.mean[0]


def test_the_noise_that_is_stated_is_the_noise_that_is_there():
    scene = scene_of(sky(), size=8)
    truth = reference_images(scene, None, SURFACES, most_directions=1024, budget=0.02)
    judged, white = truth.coverage == 1, scene.adopted_white()
    found = [reference_images(scene, None, SURFACES, most_directions=64, seed=seed) for seed in range(1, 7)]
    assert all(one.noise.limited and one.noise.directions == 256 for one in found)
    off = np.concatenate([delta_e_xyz(truth.xyz[0], one.xyz[0], white)[judged] for one in found])
    assert 0.8 < off.mean() / np.mean([one.noise.mean[0] for one in found]) < 1.25
    assert 0.6 < np.percentile(off, 99) / np.mean([one.noise.p99[0] for one in found]) < 1.7


def test_a_tenth_of_the_budget_is_kept_to_and_a_limit_is_said():
    scene = scene_of(sky())
    for budget in (6.0, 2.0):
        noise = reference_images(scene, None, SURFACES, budget=budget).noise
        assert noise.mean[0] <= noise.aimed == pytest.approx(0.1 * budget) and not noise.limited
        assert "most allowed" not in noise.words
    noise = reference_images(scene, None, SURFACES, budget=0.1, most_directions=100).noise
    assert noise.limited and noise.directions == 400 and "most allowed" in noise.words


def test_what_is_drawn_is_told_while_it_is_drawn():
    said = []
    reference_images(scene_of(sky()), None, SURFACES, progress=lambda *step: said.append(step))
    words = [step[2] for step in said]
    assert words[0].startswith("sorting") and words[-1] == "tracing"
    assert any("directions a pixel; noise of ΔE94" in one for one in words)
    assert all(0 <= done <= of == 8 for done, of, _ in said)


def test_what_cannot_be_kept_to_and_a_geometry_of_other_lights_are_refused():
    scene = scene_of(sky())
    for wrong in ({"budget": 0.0}, {"budget": float("nan")}, {"most_directions": 0}):
        with pytest.raises(InputError, match="more than 0"):
            reference_images(scene, None, SURFACES, **wrong)
    with pytest.raises(InputError, match="without lights that spread"):
        reference_images(scene_of(SUN, sky()), None, SURFACES, geometry=visible_geometry(scene_of(SUN)))


def test_a_picture_of_nothing_has_no_noise():
    scene = scene_of(sky())
    past = Camera(position=(0, 1, 9), target=(0, 1, 20), width=4, height_px=4)
    pictures = reference_images(scene, past, SURFACES)
    assert (pictures.xyz == 0).all() and (pictures.coverage == 0).all() and pictures.noise.mean == (0.0,)


@dataclass(frozen=True, eq=False)
class Dome(SpreadLight):
    """An even dome all around, so near that a wall may stand behind it."""

    spectra: tuple[Spectrum, ...] = (D65,)
    name: str = "dome"
    spectrum_name: str = ""
    away: float = 3.0

    @property
    def spectrum(self):
        return self.spectra[0]

    def counted_from(self, low, high):
        return 1000.0, self.away, self.away

    def luminance(self, points, directions):
        return np.full((len(directions), 1), 1000.0 / np.pi)

    def drawn(self, points, uniform):
        z, phi = 2.0 * uniform[:, 0] - 1.0, 2.0 * np.pi * uniform[:, 1]
        across = np.sqrt(1.0 - z * z)
        return np.stack([across * np.cos(phi), z, across * np.sin(phi)], axis=1), np.full(len(z), 0.25 / np.pi)

    def density(self, points, directions):
        return np.full(len(directions), 0.25 / np.pi)

    def distance(self, points, directions):
        return np.full(len(directions), self.away)


def test_what_stands_behind_a_light_shades_nothing():
    turned = np.diag([1.0, -1.0, -1.0, 1.0])
    turned[1, 3] = 2.0
    ceiling = plane(60, 60).transformed(turned)
    camera = Camera(position=(0, 1, 0.01), target=(0, 0, 0), vertical_fov_deg=10, width=3, height_px=3, samples=1)
    found = []
    for away in (1.5, 300.0):
        parts = (Part("floor", plane(6, 6), "ramp"), Part("ceiling", ceiling, "ramp"))
        scene = Scene(parts, (Dome(away=away),), (camera,), OBSERVER)
        found.append(reference_image(scene, None, SURFACES)[0][..., 1])
    open_sky = 1.0 * (OBSERVER.weights(D65, NM) @ RAMP.samples)[1]
    # The dome of radius 1.5 stands before the ceiling at 2; that of 300 nearly all behind it.
    np.testing.assert_allclose(found[0], open_sky, rtol=0.01)
    assert (found[1] < 0.01 * open_sky).all()


class Quietening:
    """Sums whose halves come together by a power of the directions; `scene` of so many pixels, some noisier."""

    def __init__(self, power: float, side: int = 64) -> None:
        rng = np.random.default_rng(5)
        self.directions, self.covered = np.zeros(side * side, dtype=np.int64), np.ones(side * side, dtype=bool)
        uneven = np.exp(rng.normal(0.0, 0.7, (side, side)))
        self._apart = rng.normal(0.0, 0.25, (2, side, side, 1, 3)) * np.repeat(uneven, 1)[None].reshape(
            1, side, side, 1, 1
        )
        self._power, self.said = power, []

    @property
    def halves(self):
        shape = self._apart.shape[1:3]
        return 0.4 * (1.0 + self._apart * (np.maximum(self.directions, 1.0) ** -self._power).reshape(1, *shape, 1, 1))

    def extend(self, directions, pixels=None, heard=lambda share: None):
        before = self.directions[pixels].copy()
        for step in range(4):
            self.directions[pixels] = before + (directions - before) * step // 4
            self.drawn = int(self.directions.sum())
            heard(step / 4)
        self.directions[pixels] = directions

    def say(self, share, words):
        self.said.append((self.drawn, share))


@pytest.mark.parametrize("power", [0.5, 0.75, 1.0])
def test_the_share_that_is_told_is_that_of_the_directions_within_a_factor_of_two(power):
    sums = Quietening(power)
    shape = sums.halves.shape[1:3]
    white, nothing = np.array([[0.95, 1.0, 1.09]]), np.zeros((1, *shape, 3))
    found = draw_until_quiet(sums, nothing, np.ones(shape), white, 0.15 if power < 0.6 else 0.05, 1 << 16, sums.say)
    assert not found.limited
    total, told = int(sums.directions.sum()), [(drawn, share) for drawn, share in sums.said if share > 0.1]
    assert len(told) > 8
    # By what is left of the time, as it is told to people, until little is.
    left = [((drawn / share - drawn) / (total - drawn), drawn / total) for drawn, share in told]
    assert all(0.5 <= factor <= 2.0 for factor, at in left if 0.1 < at < 0.8), left
