"""An independent eye: Mitsuba 3 renders the same scenes, and must agree with the reference within its own noise.

Films, XYZ and noise are those of `mitsuba_scenes`. A block may differ by four standard errors plus `ALLOWANCE` of
white. Only direct light is traced.
"""

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.lights import DirectionalLight, PointLight
from metamer.lighting.mesh.shapes import plane, speed_shape, sphere
from metamer.lighting.reference.reference import reference_image
from metamer.lighting.scene import Part, Scene, Viewing
from metamer.materials.analytic import CookTorrance, Lambert
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from mitsuba_scenes import ALLOWANCE, FINE_NM, Emitter, apart, blocks, finely, pictures_of, spectrum

pytestmark = pytest.mark.mitsuba

# Gold, after Johnson and Christy (1972): photon energy in eV, n, k.
GOLD = np.array(
    [
        [1.51, 0.16, 5.083], [1.64, 0.14, 4.542], [1.76, 0.13, 4.103], [1.88, 0.14, 3.697], [2.01, 0.21, 3.272],
        [2.14, 0.29, 2.863], [2.26, 0.43, 2.455], [2.38, 0.62, 2.081], [2.50, 1.04, 1.833], [2.63, 1.31, 1.849],
        [2.75, 1.38, 1.914], [2.88, 1.45, 1.948], [3.00, 1.46, 1.958], [3.12, 1.47, 1.952], [3.25, 1.46, 1.933],
    ]
)  # fmt: skip

# A reflectance as an instrument with uneven bands gives it: a bluish green with a red tail.
UNEVEN_NM = np.array([380.0, 397, 411, 430, 452, 470, 488, 503, 521, 540, 562, 590, 611, 640, 668, 700, 735, 780])
UNEVEN = np.array(
    [0.08, 0.10, 0.14, 0.22, 0.31, 0.39, 0.46, 0.50, 0.47, 0.39, 0.28, 0.17, 0.12, 0.10, 0.13, 0.22, 0.34, 0.42]
)


def mitsuba_pictures(mi, scene, bsdfs, folder, count):
    """XYZ (2, H, W, 3) of a scene with one light by Mitsuba."""
    light = scene.lights[0]
    power = finely(light)
    if isinstance(light, DirectionalLight):
        direction = (-light.direction_to_light).tolist()
        described = {"type": "directional", "direction": direction, "irradiance": spectrum(power, FINE_NM)}
        emitter = Emitter(described, power, light.illuminance_lux)
    else:
        described = {"type": "point", "position": light.position.tolist(), "intensity": spectrum(power, FINE_NM)}
        emitter = Emitter(described, power, light.intensity_cd)
    integrator = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
    return pictures_of(mi, scene, emitter, integrator, bsdfs, folder, count)


def assert_agrees(ours, theirs, name, record_property):
    difference, noise = apart(ours, theirs)
    seen = blocks(ours)
    lit = seen[:, 1] > 0.002
    level, whole = seen[lit].mean(), seen.mean(axis=0)
    figures = {
        "mean Y of lit blocks": float(seen[lit, 1].mean()),
        "rms difference of blocks / mean XYZ": float(np.sqrt(np.mean(difference[lit] ** 2)) / level),
        "rms noise of blocks / mean XYZ": float(np.sqrt(np.mean(noise[lit] ** 2)) / level),
        "difference of whole picture / its XYZ": (difference.mean(axis=0) / whole).tolist(),
        "noise of whole picture / its XYZ": (np.sqrt((noise**2).mean(axis=0) / len(noise)) / whole).tolist(),
        "worst block, in standard errors beyond the allowance": float(
            np.max((np.abs(difference) - ALLOWANCE) / np.maximum(noise, 1e-12))
        ),
    }
    for figure, value in figures.items():
        record_property(f"{name}: {figure}", value)
        print(f"{name}: {figure}: {value}")
    excess = np.abs(difference) - 4.0 * noise - ALLOWANCE
    block, channel = np.unravel_index(np.argmax(excess), excess.shape)
    assert excess.max() <= 0.0, (
        f"block {block}, channel {'XYZ'[channel]}: ours {seen[block, channel]:.6f}, "
        f"Mitsuba {blocks(theirs.mean(axis=0))[block, channel]:.6f}, its standard error {noise[block, channel]:.6f}"
    )


def gold_constants():
    order = np.argsort(-GOLD[:, 0])
    wavelengths_nm = 1239.84198 / GOLD[order, 0]
    return tuple(np.interp(WORKING_WAVELENGTHS_NM, wavelengths_nm, GOLD[order, k]) for k in (1, 2))


def gold(alpha):
    """Our rough gold and Mitsuba's."""
    n, k = gold_constants()
    black = Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.zeros(81))
    ours = CookTorrance(black, n, k, alpha, 1.0, distribution="ggx", masking="smith")
    eta, absorption = spectrum(n), spectrum(k)
    theirs = {"type": "roughconductor", "distribution": "ggx", "alpha": alpha, "eta": eta, "k": absorption}
    return ours, theirs


def lambert(wavelengths_nm, values):
    """Our Lambert surface and Mitsuba's; Mitsuba gets the samples as measured, ours goes over the working grid."""
    measured = Spectrum.sampled(wavelengths_nm, values)
    ours = Lambert(measured.resampled(WORKING_WAVELENGTHS_NM))
    return ours, {"type": "diffuse", "reflectance": spectrum(values, wavelengths_nm)}


def test_lambert_sphere_of_an_uneven_measurement_under_fl11(mi, tmp_path, record_property):
    ours, theirs = lambert(UNEVEN_NM, UNEVEN)
    camera = Camera(projection="orthographic", height=2.2, width=64, height_px=64, samples=8)
    scene = Scene(
        (Part("ball", sphere(), "paint"),),
        (DirectionalLight((-0.45, 0.46, 0.766), illuminant("FL11"), 1000.0),),
        (camera,),
        observer("1931_2"),
    )
    xyz, _ = reference_image(scene, None, {"paint": ours})
    pictures = mitsuba_pictures(mi, scene, {"paint": theirs}, tmp_path, 256)
    assert_agrees(xyz, pictures, "Lambert sphere, FL11", record_property)


def test_rough_gold_sphere_under_a(mi, tmp_path, record_property):
    ours, theirs = gold(0.3)
    camera = Camera(projection="orthographic", height=2.2, width=64, height_px=64, samples=8)
    scene = Scene(
        (Part("ball", sphere(), "gold"),),
        (DirectionalLight((0.5, 0.3, 0.6), illuminant("A"), 1000.0),),
        (camera,),
        observer("1964_10"),
    )
    xyz, _ = reference_image(scene, None, {"gold": ours})
    pictures = mitsuba_pictures(mi, scene, {"gold": theirs}, tmp_path, 256)
    assert_agrees(xyz, pictures, "rough gold sphere, A", record_property)


def test_gold_speed_shape_shadows_a_painted_floor_under_a_point_light(mi, tmp_path, record_property):
    gold_ours, gold_theirs = gold(0.35)
    floor_ours, floor_theirs = lambert(UNEVEN_NM, UNEVEN)
    camera = Camera(
        position=(0.8, 2.4, 5.5), target=(0.2, 0.3, 0), vertical_fov_deg=28, width=96, height_px=64, samples=8
    )
    scene = Scene(
        (Part("body", speed_shape(), "gold"), Part("floor", plane(8, 8), "paint")),
        (PointLight((-1.6, 2.2, 1.5), illuminant("FL11"), 4000.0),),
        (camera,),
        observer("1931_2"),
        Viewing(reference_illuminance_lux=800.0),
    )
    xyz, coverage = reference_image(scene, None, {"gold": gold_ours, "paint": floor_ours})
    assert ((coverage > 0) & (xyz[..., 1] == 0)).sum() > 100, "the picture must hold a cast shadow"
    pictures = mitsuba_pictures(mi, scene, {"gold": gold_theirs, "paint": floor_theirs}, tmp_path, 256)
    assert_agrees(xyz, pictures, "gold speed shape on a floor, point light, FL11", record_property)
