"""Small scenes and hand-made packs that the renderer's tests share."""

import numpy as np
from metamer.lighting.camera import Camera
from metamer.lighting.lights import DirectionalLight, PointLight
from metamer.lighting.mesh import shapes
from metamer.lighting.scene import Part, Scene
from metamer.materials.core.axes import Axis
from metamer.materials.factored.pack import FactoredBrdf, FactorPack
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.palette import Palette

QUARTER, HALF, TURN = np.pi / 2, np.pi, 2 * np.pi
BASIS = SpectralBasis.sampled()


def spectrum(seed: int) -> np.ndarray:
    """A smooth reflectance on the working wavelengths, (81,)."""
    rng = np.random.default_rng(seed)
    x = np.linspace(0.0, 1.0, BASIS.size)
    return 0.5 + 0.2 * np.sin(TURN * (rng.random() + x)) + 0.2 * np.cos(TURN * (2 * x + rng.random()))


def lambert_pack(reflectance: np.ndarray) -> FactorPack:
    """f_r cos(theta_i) of a matt surface, one term."""
    axes = (Axis("theta_i", 91, QUARTER), Axis("theta_o", 2, QUARTER), Axis("phi", 2, HALF))
    factors = (np.cos(axes[0].nodes)[:, None] / np.pi, np.ones((2, 1)), np.ones((2, 1)))
    return FactorPack("io", axes, factors, Palette.of(reflectance[None]))


def lobe_pack(width: float = 0.12, anisotropic: bool = False) -> FactorPack:
    """f_r of a glossy coat: two terms that rise toward grazing, one that leans with phi_d."""
    axes = [Axis("theta_h", 90, QUARTER, "sqrt"), Axis("theta_d", 46, QUARTER), Axis("phi_d", 46, HALF)]
    if anisotropic:
        axes[2] = Axis("phi_d", 91, TURN, periodic=True)
        axes.append(Axis("phi_h", 91, TURN, periodic=True))
    theta_h, theta_d, phi_d = (axis.nodes for axis in axes[:3])
    peak = np.exp(-((np.tan(np.minimum(theta_h, 1.5)) / width) ** 2)) / (4 * np.pi * width**2)
    factors = [
        np.stack([peak, peak * np.sqrt(np.sin(theta_h)), 0.05 * np.cos(theta_h)], axis=1),
        np.stack([0.04 + 0.96 * (1 - np.cos(theta_d)) ** 5, np.cos(theta_d), np.cos(theta_d)], axis=1),
        np.stack([np.ones_like(phi_d), 0.2 * np.cos(2 * phi_d), 1 + 0.5 * np.cos(phi_d)], axis=1),
    ]
    if anisotropic:
        phi_h = axes[3].nodes
        factors.append(np.stack([1 + 0.8 * np.cos(2 * phi_h), np.ones_like(phi_h), np.ones_like(phi_h)], axis=1))
    coat = np.stack([np.full(BASIS.size, 0.9), spectrum(5), spectrum(6)])
    return FactorPack("hd", tuple(axes), tuple(factors), Palette.of(coat))


def woven_pack() -> FactorPack:
    """f_r cos(theta_i) of a weave: anisotropic, io frame, one term for warp and one for weft."""
    axes = (
        Axis("theta_i", 46, QUARTER),
        Axis("theta_o", 46, QUARTER),
        Axis("phi", 91, TURN, periodic=True),
        Axis("phi_i", 91, TURN, periodic=True),
    )
    theta_i, theta_o, phi, phi_i = (axis.nodes for axis in axes)
    factors = (
        np.stack([np.cos(theta_i), np.sin(2 * theta_i)], axis=1) / np.pi,
        np.stack([np.ones_like(theta_o), np.sin(theta_o)], axis=1),
        np.stack([1 + 0.2 * np.cos(phi), 0.5 + 0.5 * np.sin(phi)], axis=1),
        np.stack([1 + 0.5 * np.cos(2 * phi_i), 0.5 + 0.4 * np.sin(phi_i)], axis=1),
    )
    return FactorPack("io", axes, factors, Palette.of(np.stack([spectrum(8), spectrum(9)])))


SURFACES = {
    "matt": FactoredBrdf((lambert_pack(spectrum(1)),)),
    "gloss": FactoredBrdf((lambert_pack(spectrum(2)), lobe_pack())),
    "sharp": FactoredBrdf((lambert_pack(0.3 * spectrum(3)), lobe_pack(0.02))),
    "brushed": FactoredBrdf((lobe_pack(0.2, anisotropic=True),)),
    "woven": FactoredBrdf((woven_pack(),)),
}


def sun(direction=(0.4, 0.7, 0.6), lux=1000.0, name="D65") -> DirectionalLight:
    return DirectionalLight(np.array(direction, dtype=float), illuminant(name), lux)


def lamp(position=(1.2, 1.5, 1.4), candela=2000.0, name="A") -> PointLight:
    return PointLight(np.array(position, dtype=float), illuminant(name), candela)


def scene_of(parts, lights, camera: Camera) -> Scene:
    """`parts` are (mesh, material id) pairs."""
    named = tuple(Part(f"part{number}", mesh, material) for number, (mesh, material) in enumerate(parts))
    return Scene(named, tuple(lights), (camera,), observer("1931_2"))


def sphere_scene(material="gloss", size=64, samples=3) -> Scene:
    camera = Camera("ortho", (0, 0, 4), (0, 0, 0), (0, 1, 0), "orthographic", height=2.2, width=size, height_px=size,
                    samples=samples)  # fmt: skip
    return scene_of([(shapes.sphere(4), material)], [sun()], camera)


def cloth_scene(material="gloss", size=64, samples=3, divisions=60) -> Scene:
    """A draped cloth on the ground under a low sun: folds that shade one another and the ground."""
    cloth = shapes.cloth(divisions)
    camera = Camera("above", (0.3, 2.6, 3.6), (0, 0.3, 0), vertical_fov_deg=36, width=size, height_px=size,
                    samples=samples)  # fmt: skip
    return scene_of([(cloth, material), (shapes.plane(6, 6), "matt")], [sun((0.8, 0.45, 0.1))], camera)


def lamp_scene(material="gloss", size=64, samples=3) -> Scene:
    """Two spheres, one in the other's shadow, over the ground, by lamp and sun."""
    ball, small = shapes.sphere(4), shapes.sphere(3, 0.35)
    lift = np.eye(4)
    lift[:3, 3] = 0.7, 0.9, 0.9
    sink = np.eye(4)
    sink[1, 3] = -0.9
    parts = [
        (ball, material),
        (small.transformed(lift), "sharp"),
        (shapes.plane(7, 7).transformed(sink), "matt"),
    ]
    camera = Camera("near", (0.5, 1.0, 5.0), (0, 0, 0), vertical_fov_deg=34, width=size, height_px=size,
                    samples=samples)  # fmt: skip
    return scene_of(parts, [lamp((1.6, 2.2, 2.0)), sun((-0.5, 0.8, 0.3), 400.0)], camera)


def two_balls(material="gloss", size=32) -> Scene:
    """A small ball that shades a large one, over the ground: few vertices."""
    parts = [
        (shapes.sphere(2), material),
        (shapes.sphere(2, 0.35).placed(translate=(0.7, 0.9, 0.9)), "matt"),
        (shapes.plane(5.0, 5.0).placed(translate=(0, -0.9, 0)), "matt"),
    ]
    camera = Camera("near", (0.5, 1.0, 5.0), (0, 0, 0), vertical_fov_deg=34, width=size, height_px=size, samples=1)
    return scene_of(parts, [lamp((1.6, 2.2, 2.0)), sun((-0.5, 0.8, 0.3), 400.0)], camera)


def far_lamp_scene(material="gloss", size=64, samples=3) -> Scene:
    """The ball, its shadow and the ground by a lamp so far off that the scene is a point to it."""
    scene = lamp_scene(material, size, samples)
    place = 5000.0 * np.array([0.3, 0.6, 0.6])
    return scene_of([(part.mesh, part.material) for part in scene.parts], [lamp(place, 1e3 * place @ place)],
                    scene.camera())  # fmt: skip
