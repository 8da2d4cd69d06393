"""An independent eye: Mitsuba 3 renders the same scenes, and must agree with the reference within its own noise.

How the two are brought together. Mitsuba's film gets our colour-matching functions as its sensor responses, so that its
own tables and its own normalisation of Y (1.0010 for a unit spectrum) stay out of the comparison; a channel is then the
integral of radiance x response over 360 to 830 nm. XYZ with Y = 1 for the perfect diffuser is pi times that over the
integral of light x y-bar. Its `eval` contains the cosine, ours does not. Only direct light is traced.

Its samples are random in position and wavelength. Two seeds tell the noise: the variance of a block of 8 x 8 pixels is
estimated from the squared differences of the seeds, pixel by pixel. A block may differ by four standard errors plus
`ALLOWANCE` of white, for our regular sample points at outlines and the 5 nm grid.
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

pytestmark = pytest.mark.mitsuba

ALLOWANCE = 0.001
BLOCK = 8
FINE_NM = np.arange(360.0, 831.0)

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


def spectrum(values, wavelengths_nm=FINE_NM, extend=True):
    """A Mitsuba spectrum, linear between samples; held to the ends of the range that Mitsuba integrates over."""
    if extend:
        values = np.interp(FINE_NM, wavelengths_nm, values)
        wavelengths_nm = FINE_NM
    return {
        "type": "irregular",
        "wavelengths": ", ".join(f"{w:.9g}" for w in wavelengths_nm),
        "values": ", ".join(f"{v:.9g}" for v in values),
    }


def mitsuba_pictures(mi, scene, bsdfs, folder, count, seeds=(11, 12)):
    """XYZ (2, H, W, 3) of `scene` by Mitsuba, one a seed."""
    import trimesh

    camera, light = scene.camera(), scene.lights[0]
    cmfs = np.stack([np.interp(FINE_NM, scene.observer.wavelengths_nm, c) for c in scene.observer.cmfs.T], axis=1)
    power = np.interp(FINE_NM, light.spectrum.wavelengths_nm, light.spectrum.samples)
    film = {"type": "specfilm", "width": camera.width, "height": camera.height_px, "rfilter": {"type": "box"}}
    film |= {name: spectrum(cmfs[:, k]) for k, name in enumerate(("band0_x", "band1_y", "band2_z"))}
    place = mi.ScalarTransform4f().look_at(
        origin=camera.position.tolist(), target=camera.target.tolist(), up=camera.up.tolist()
    )
    if camera.projection == "orthographic":
        sensor = {"type": "orthographic", "to_world": place @ mi.ScalarTransform4f().scale(camera.height / 2)}
    else:
        sensor = {"type": "perspective", "to_world": place, "fov": camera.vertical_fov_deg, "fov_axis": "y"}
        sensor |= {"near_clip": 0.01, "far_clip": 1000.0}
    if isinstance(light, DirectionalLight):
        direction = (-light.direction_to_light).tolist()
        emitter = {"type": "directional", "direction": direction, "irradiance": spectrum(power)}
        strength = light.illuminance_lux
    else:
        emitter = {"type": "point", "position": light.position.tolist(), "intensity": spectrum(power)}
        strength = light.intensity_cd
    world = {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
        "sensor": sensor | {"film": film, "sampler": {"type": "independent", "sample_count": count}},
        "light": emitter,
    }
    for part in scene.parts:
        mesh = trimesh.Trimesh(part.mesh.vertices, part.mesh.faces, vertex_normals=part.mesh.normals, process=False)
        file = folder / f"{part.name}.ply"
        mesh.export(file, vertex_normal=True)
        world[part.name] = {"type": "ply", "filename": str(file), "bsdf": bsdfs[part.material]}
    loaded = mi.load_dict(world)
    scale = np.pi / (power @ cmfs[:, 1]) * strength / scene.viewing.reference_illuminance_lux
    return np.stack([np.array(mi.render(loaded, seed=seed), dtype=np.float64) * scale for seed in seeds])


def blocks(image):
    """(h, w, 64, 3): the pixels of each 8 x 8 block."""
    height, width, _ = image.shape
    split = image.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3)
    return split.transpose(0, 2, 1, 3, 4).reshape(height // BLOCK, width // BLOCK, BLOCK * BLOCK, 3)


def assert_agrees(ours, theirs, name, record_property):
    difference = blocks(ours - theirs.mean(axis=0)).mean(axis=2)
    variance = blocks((theirs[0] - theirs[1]) ** 2).mean(axis=2) / 4.0 / BLOCK**2
    noise = np.sqrt(variance)
    lit = blocks(ours).mean(axis=2)[..., 1] > 0.002
    level = blocks(ours).mean(axis=2)[lit].mean()
    figures = {
        "mean Y of lit blocks": float(blocks(ours).mean(axis=2)[lit][:, 1].mean()),
        "rms difference of blocks / mean XYZ": float(np.sqrt(np.mean(difference[lit] ** 2)) / level),
        "rms noise of blocks / mean XYZ": float(np.sqrt(np.mean(variance[lit])) / level),
        "difference of whole picture / its XYZ": (difference.mean((0, 1)) / blocks(ours).mean((0, 1, 2))).tolist(),
        "noise of whole picture / its XYZ": (
            np.sqrt(variance.mean((0, 1)) / variance[..., 0].size) / blocks(ours).mean((0, 1, 2))
        ).tolist(),
        "worst block, in standard errors beyond the allowance": float(
            np.max((np.abs(difference) - ALLOWANCE) / np.maximum(noise, 1e-12))
        ),
    }
    for figure, value in figures.items():
        record_property(f"{name}: {figure}", value)
        print(f"{name}: {figure}: {value}")
    excess = np.abs(difference) - 4.0 * noise - ALLOWANCE
    worst = np.unravel_index(np.argmax(excess), excess.shape)
    assert excess.max() <= 0.0, (
        f"block {worst[:2]}, channel {'XYZ'[worst[2]]}: ours {blocks(ours).mean(axis=2)[worst]:.6f}, "
        f"Mitsuba {blocks(theirs.mean(axis=0)).mean(axis=2)[worst]:.6f}, its standard error {noise[worst]:.6f}"
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
    eta, absorption = spectrum(n, WORKING_WAVELENGTHS_NM), spectrum(k, WORKING_WAVELENGTHS_NM)
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
