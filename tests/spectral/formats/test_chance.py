"""Signs that guess a quantity from the shape of data are found by chance in fewer than 1 of 10,000 noises."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats.registry import read_spectra
from metamer.spectral.formats.shared.resemblance import has_mercury_lines, is_above_noise, likenesses
from metamer.spectral.illuminants import illuminant

DRAWS = 10_001
NOISES = {
    "gaussian": lambda draw, shape: draw.standard_normal(shape),
    "uniform": lambda draw, shape: draw.uniform(size=shape),
    "laplace": lambda draw, shape: draw.laplace(size=shape),
    "few photons": lambda draw, shape: draw.poisson(3.0, shape).astype(float),
    "drift": lambda draw, shape: np.cumsum(draw.standard_normal(shape), axis=1),
    "exponential": lambda draw, shape: draw.exponential(size=shape),
    "Student's t of 3": lambda draw, shape: draw.standard_t(3.0, shape),
    "Student's t of 2": lambda draw, shape: draw.standard_t(2.0, shape),
    "lognormal": lambda draw, shape: draw.lognormal(0.0, 1.0, shape),
    "gamma": lambda draw, shape: draw.gamma(0.3, size=shape),
    "Weibull": lambda draw, shape: draw.weibull(0.6, shape),
    "steps of any height": lambda draw, shape: np.cumsum(draw.exponential(size=shape), axis=1),
    "moving average": lambda draw, shape: correlated(draw, shape, np.ones(5)),
    "pink": lambda draw, shape: pink(draw, shape),
    "whole numbers": lambda draw, shape: np.round(draw.standard_normal(shape) / 3.0) * 3.0,
    "Cauchy": lambda draw, shape: draw.standard_cauchy(shape),
    "spikes": lambda draw, shape: draw.standard_normal(shape) + spikes(draw, shape, 0.01, 30.0),
    "few spikes": lambda draw, shape: draw.standard_normal(shape) + spikes(draw, shape, 0.003, 200.0),
    "many spikes": lambda draw, shape: draw.standard_normal(shape) + spikes(draw, shape, 0.1, 30.0),
    "spikes of any height": lambda draw, shape: (draw.random(shape) < 0.02) * draw.pareto(1.0, shape),
    "lines": lambda draw, shape: draw.standard_normal(shape) + correlated(draw, shape, LINE, 0.02),
    "narrow lines": lambda draw, shape: draw.standard_normal(shape) + correlated(draw, shape, LINE[::2], 0.05),
}
LINE = 600.0 * np.exp(-0.5 * (np.arange(-6, 7) / 2.0) ** 2)


def spikes(draw, shape, share, height):
    return height * (draw.random(shape) < share) * draw.exponential(size=shape)


def correlated(draw, shape, kernel, share=1.0):
    """Noise of this share of the samples, or Gaussian where it is of all, convolved with a kernel."""
    noise = draw.standard_normal(shape) if share == 1.0 else spikes(draw, shape, share, 1.0)
    return sum(weight * np.roll(noise, at, axis=1) for at, weight in enumerate(kernel))


def pink(draw, shape):
    """Noise whose power falls as 1/f."""
    frequency = np.maximum(np.fft.rfftfreq(2 * shape[1]), 1.0 / (2 * shape[1]))
    parts = draw.standard_normal((2, shape[0], frequency.size)) / np.sqrt(frequency)
    return np.fft.irfft(parts[0] + 1j * parts[1], axis=1)[:, : shape[1]]


@pytest.mark.parametrize("step", [5.0, *(pytest.param(step, marks=pytest.mark.stress) for step in (2.0, 1.0))])
@pytest.mark.parametrize("kind", NOISES)
def test_noise_has_no_lines_of_mercury(kind, step):
    grid = np.arange(380.0, 780.1, step)
    noise = NOISES[kind](np.random.default_rng(7), (DRAWS, grid.size))
    for background in (0.0, 40.0 * np.exp(-(((grid - 560.0) / 90.0) ** 2))):
        assert has_mercury_lines(grid, 1200.0 + 30.0 * noise + background).sum() <= DRAWS // 10_000
    assert not has_mercury_lines(grid, np.full((2, grid.size), 3.0)).any()


def test_a_few_photons_and_nothing_else_are_no_lines():
    grid = np.arange(380.0, 780.1, 5.0)
    assert not has_mercury_lines(grid, np.random.default_rng(7).poisson(0.1, (DRAWS, grid.size)).astype(float)).any()


def test_noise_of_a_fine_instrument_has_none():
    grid = np.arange(380.0, 730.0, 0.37)
    draw = np.random.default_rng(11)
    for noise in (draw.standard_normal((2000, grid.size)), draw.laplace(size=(500, grid.size))):
        assert not has_mercury_lines(grid, 1200.0 + 30.0 * noise).any()


@pytest.mark.parametrize("step", [0.37, 1.0, 5.0])
@pytest.mark.parametrize("width", [2.0, 5.0])
def test_lines_above_noise_are_found(step, width):
    """A lamp of mercury on a continuum, as an instrument of this bandwidth sees it."""
    grid = np.arange(380.0, 780.0, step)
    lines = sum(np.exp(-4.0 * np.log(2.0) * ((grid - line) / max(width, step)) ** 2) for line in (404.7, 435.8, 546.1))
    continuum = np.exp(-(((grid - 590.0) / 60.0) ** 2))
    seen = lines + continuum + 0.01 * np.random.default_rng(3).standard_normal((20, grid.size))
    assert has_mercury_lines(grid, seen).all()


@pytest.mark.parametrize("name", [*(f"FL{n}" for n in range(1, 13)), *(f"FL3.{n}" for n in range(1, 16))])
@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e6])
def test_lamps_of_the_cie_have_them_at_any_scale(name, scale):
    light = illuminant(name)
    assert has_mercury_lines(light.wavelengths_nm, scale * light.samples[None])[0]
    for step, first in ((0.37, 380.0), (1.0, 380.4), (2.0, 381.0), (5.0, 381.5)):
        grid = np.arange(first, 780.0, step)
        assert has_mercury_lines(grid, scale * np.interp(grid, light.wavelengths_nm, light.samples)[None])[0]


@pytest.mark.parametrize("contrast", [1e-4, 0.002, 0.05])
def test_noise_of_any_level_resembles_no_grey_of_a_chart(contrast):
    grid = np.arange(400.0, 701.0, 10.0)
    draw = np.random.default_rng(5)
    level = np.exp(draw.uniform(np.log(0.02), np.log(95.0), (DRAWS, 1)))
    found = likenesses(grid, level * (1.0 + contrast * draw.standard_normal((DRAWS, grid.size))))
    assert sum(like is not None for like in found) <= DRAWS // 10_000


@pytest.mark.parametrize("count", [12, 31, *(pytest.param(count, marks=pytest.mark.stress) for count in (16, 81, 401))])
@pytest.mark.parametrize("kind", ["gaussian", "few photons", "Cauchy", "spikes", "moving average", "pink", "drift"])
def test_noise_about_a_level_is_no_light_by_its_range(count, kind):
    noise = NOISES[kind](np.random.default_rng(4), (DRAWS, count))
    noise = noise / np.abs(noise).max(axis=1, keepdims=True).clip(1e-12)
    # A level that correlated noise does not fall far below; white noise of any contrast.
    for share in (0.02, 0.3) if kind in ("moving average", "pink", "drift") else (0.02, 0.3, 1.0):
        assert sum(map(is_above_noise, 1200.0 * (1.0 + share * noise))) <= DRAWS // 10_000


@pytest.mark.parametrize("step", [1.0, 5.0, 10.0])
def test_lights_are_more_than_noise(step):
    grid = np.arange(380.0, 780.1, step)
    for name in ("A", "D65", "LED-B1", "LED-RGB1", "FL2", "HP2"):
        light = illuminant(name)
        assert is_above_noise(900.0 * np.interp(grid, light.wavelengths_nm, light.samples))


def test_noise_in_a_file_that_is_called_a_lamp_is_asked_about(written):
    grid = np.arange(380.0, 730.0, 0.37)
    noise = 1200.0 + 35.0 * np.random.default_rng(2).standard_normal(grid.size)
    path = written("".join(f"{nm:.2f},{value:.2f}\n" for nm, value in zip(grid, noise, strict=True)), "LED panel.csv")
    with pytest.raises(InputError, match="what was measured"):
        read_spectra(path)


def test_noise_without_a_word_is_asked_about(written):
    grid = np.arange(380.0, 730.0, 0.37)
    noise = 1200.0 + 35.0 * np.random.default_rng(2).standard_normal((8, grid.size))
    rows = [",".join(f"{cell:.2f}" for cell in row) for row in np.vstack([grid, noise]).T]
    path = written("Wavelength," + ",".join(f"c{place}" for place in range(8)) + "\n" + "\n".join(rows) + "\n")
    with pytest.raises(InputError, match="what was measured"):
        read_spectra(path)
