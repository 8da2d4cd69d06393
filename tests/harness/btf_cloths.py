"""Small BTFs of cloth in files, and what is asked of each from its files to a picture."""

import numpy as np
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.core.protocol import measured
from metamer.materials.formats.btf_names import directions_of
from metamer.materials.intake.importing import import_sources
from metamer.spectral.formats.import_options import ImportOptions
from metamer.viewer.software.backend import software_session

#: Nine directions: the normal, four at 30 degrees, four at 60.
NINE = [(0, 0)] + [(theta, phi) for theta in (30, 60) for phi in range(0, 360, 90)]
SAID = ImportOptions(encoding="srgb", white=(1.0,))
UBO = "{n:05d} tl{tl:03d} pl{pl:03d} tv{tv:03d} pv{pv:03d}.png"


def cloth(views=NINE, lights=NINE, size=(8, 8), shine=0.1, seed=0):
    """Dyed bumps with a highlight: fractions of white, (V,Lt,H,W,3)."""
    draw = np.random.default_rng(seed)
    y, x = np.mgrid[: size[0], : size[1]] * 2.0 * np.pi
    lean = 0.3 * np.stack([np.sin(x / size[1]), np.cos(y / size[0] + 1.0)], axis=2)
    normal = np.concatenate([lean, np.ones((*size, 1))], axis=2)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    colour = draw.uniform(0.2, 0.6, (*size, 3)) * (1.0, 0.8, 0.6)
    to_view, to_light = directions_of(views), directions_of(lights)
    half = to_view[:, None] + to_light
    half /= np.linalg.norm(half, axis=2, keepdims=True)
    body = np.maximum(np.einsum("ld,hwd->lhw", to_light, normal), 0.0)[None, ..., None] * colour
    glint = np.maximum(np.einsum("vld,hwd->vlhw", half, normal), 0.0)[..., None] ** 20
    return body + shine * glint * to_light[:, 2, None, None, None]


def saved(folder, values, views=NINE, lights=NINE, name=UBO):
    """Save as images of 8 bits by sRGB's curve; what is beyond full scale is held there, as a camera does."""
    from PIL import Image

    held = np.clip(values, 0.0, 1.0)
    encoded = np.where(held <= 0.0031308, 12.92 * held, 1.055 * held ** (1.0 / 2.4) - 0.055)
    codes, n = np.rint(255.0 * encoded).astype(np.uint8), 0
    for v, (tv, pv) in enumerate(views):
        for at, (tl, pl) in enumerate(lights):
            n += 1
            path = folder / name.format(n=n, tl=tl, pl=pl, tv=tv, pv=pv)
            path.parent.mkdir(parents=True, exist_ok=True)
            Image.fromarray(codes[v, at]).save(path)
    return folder


def imported(source, catalogue, said=SAID):
    """The one material of a catalogue that the source was brought into, its file read again."""
    report = import_sources([source], catalogue, jobs=1, answer=said)
    assert report.count("imported") == 1, report.outcomes
    opened = Catalogue.open(catalogue)
    assert not any(opened.verify().values())
    (found,) = opened.ids()
    return opened[found]


def refused(source, catalogue, said=SAID):
    """Why nothing was imported."""
    report = import_sources([source], catalogue, jobs=1, answer=said)
    (one,) = report.outcomes
    assert one.status == "failed" and not report.count("imported")
    return one.reason


def draped(scenes):
    """A ball and what it stands on, covered with "cloth"."""
    parts = [
        (shapes.sphere(2, uv=True).placed(translate=(0.0, 0.9, 0.0)), "cloth"),
        (shapes.plane(6.0, 6.0), "cloth"),
    ]
    camera = Camera("c", (0.5, 3.5, 6.0), (0.0, 0.5, 0.0), vertical_fov_deg=30.0, width=18, height_px=14, samples=1)
    return scenes.scene_of(parts, [scenes.sun(), scenes.lamp()], camera)


def drawn(scenes, fast, renderer=None):
    """XYZ of a picture, with nothing in it that cannot be."""
    scene = draped(scenes)
    with renderer or software_session() as one:
        picture, covered = one.render(scene, None, {"cloth": fast})
    assert np.isfinite(picture).all() and covered.max() > 0.0
    # Rounding leaves a black texel a little below it.
    white = scene.adopted_white()[1]
    assert picture.min() > -0.02 * white and picture.max() < 50.0 * white
    return picture


def error_of(found):
    """Mean ΔE94 of a record's fast form against its own images, under the light where it is largest."""
    form = measured(found.fast, found.surface(), 16)
    return max(light.mean for light in form.error.lights)
