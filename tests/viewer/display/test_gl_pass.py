"""The display transform on the GPU against the same transform on the CPU."""

from pathlib import Path

import numpy as np
import pytest
from metamer.spectral.image import ColourImage
from metamer.viewer.display.gl_pass import DisplayPass
from metamer.viewer.display.transform import DISPLAY_WHITE_XYZ, PINNED_CONFIG, DisplayTransform

CUBE_CONFIG = """ocio_profile_version: 2.1
search_path: .
roles:
  default: raw
  scene_linear: xyz
  cie_xyz_d65_interchange: xyz
displays:
  Bench:
    - !<View> {{name: Cube, colorspace: bench}}
colorspaces:
  - !<ColorSpace>
    name: raw
    isdata: true
  - !<ColorSpace>
    name: xyz
  - !<ColorSpace>
    name: bench
    from_scene_reference: !<GroupTransform>
      children:
        - !<FileTransform> {{src: curve.spi1d, interpolation: linear}}
        - !<FileTransform> {{src: twist.cube, interpolation: {interpolation}}}
"""


def table_config(folder: Path, interpolation: str) -> str:
    """A configuration with a 1-D curve followed by a 9 x 9 x 9 table, both written here; returns its path."""
    steps = np.linspace(0.0, 1.0, 9)
    blue, green, red = np.meshgrid(steps, steps, steps, indexing="ij")
    twisted = np.stack([red**0.5, 0.8 * green + 0.2 * red * blue, blue**2], axis=-1).reshape(-1, 3)
    rows = "\n".join(" ".join(f"{value:.6f}" for value in row) for row in twisted)
    (folder / "twist.cube").write_text(f"LUT_3D_SIZE 9\n{rows}\n")
    curve = "\n".join(f"{value:.6f}" for value in np.linspace(0.0, 1.0, 5000) ** 0.7)
    (folder / "curve.spi1d").write_text(f"Version 1\nFrom 0.0 1.0\nLength 5000\nComponents 1\n{{\n{curve}\n}}\n")
    path = folder / "config.ocio"
    path.write_text(CUBE_CONFIG.format(interpolation=interpolation))
    return str(path)


@pytest.fixture(scope="module")
def pixels() -> np.ndarray:
    """XYZ inside, at and outside the gamut, an odd number of pixels wide."""
    drawn = np.random.default_rng(3).uniform(-0.1, 1.4, (37, 61, 3)).astype(np.float32)
    drawn[0, :2] = (DISPLAY_WHITE_XYZ, (0, 0, 0))
    return drawn


def assert_twins(gpu: np.ndarray, cpu: np.ndarray, tolerance: float) -> None:
    """Equal to `tolerance`, or the worst pixel and both values."""
    error = np.abs(gpu - cpu).max(axis=-1)
    at = np.unravel_index(error.argmax(), error.shape)
    assert error[at] <= tolerance, f"pixel {at}: GPU {gpu[at]}, CPU {cpu[at]}"


def test_pinned_configuration(gl, pixels):
    transform = DisplayTransform(config=PINNED_CONFIG)
    assert_twins(DisplayPass(gl, transform)(pixels), transform.apply(pixels), 2e-6)


@pytest.mark.parametrize("interpolation", ["linear", "tetrahedral"])
def test_configuration_with_look_up_tables(gl, pixels, tmp_path, interpolation):
    transform = DisplayTransform(config=table_config(tmp_path, interpolation), display="Bench", view="Cube")
    # A texture unit may weigh with 8 bits of fraction: off by 2^-9 of the step between two entries, here < 0.36.
    assert_twins(DisplayPass(gl, transform)(pixels), transform.apply(pixels), 0.36 * 3 / 512)


def test_view_with_one_dimensional_tables(gl, pixels):
    """ACES 2 output transforms index small tables; they reach the shader as rows of 2-D textures."""
    import PyOpenColorIO as ocio

    name = "cg-config-v4.0.0_aces-v2.0_ocio-v2.5"
    if name not in [entry[0] for entry in ocio.BuiltinConfigRegistry().getBuiltinConfigs()]:
        pytest.skip(f"this OpenColorIO has no built-in {name}")
    transform = DisplayTransform(config=f"ocio://{name}", view="ACES 2.0 - SDR 100 nits (Rec.709)")
    assert_twins(DisplayPass(gl, transform)(pixels), transform.apply(pixels), 2e-3)


def test_encode_says_the_same_on_both(gl, pixels):
    transform = DisplayTransform(config=PINNED_CONFIG)
    picture = ColourImage(pixels, "xyz", np.array([1.0986, 1.0, 0.3558]))
    coverage = np.full(pixels.shape[:2], 0.75)
    arguments = (picture, coverage, np.array([0.2, 0.2, 0.1]))
    cpu, cpu_notes = transform.encode(*arguments)
    gpu, gpu_notes = transform.encode(*arguments, on=DisplayPass(gl, transform))
    assert_twins(gpu, cpu, 2e-6)
    assert gpu_notes == cpu_notes


def test_rows_stay_in_order(gl):
    picture = np.zeros((3, 2, 3), dtype=np.float32)
    picture[0] = DISPLAY_WHITE_XYZ
    encoded = DisplayPass(gl, DisplayTransform(config=PINNED_CONFIG))(picture)
    assert encoded[0].min() > 0.99 and encoded[1:].max() < 0.01
