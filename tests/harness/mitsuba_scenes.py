"""Scenes of ours rendered by Mitsuba 3, its pictures in XYZ, and the comparison of both within their noise.

Mitsuba's film gets our colour-matching functions as its sensor responses, so that its own tables and its own
normalisation of Y (1.0010 for a unit spectrum) stay out of the comparison; a channel is then the integral of radiance x
response over 360 to 830 nm. XYZ with Y = 1 for the perfect diffuser is pi times that over the integral of light x
y-bar. Its `eval` contains the cosine, ours does not.

Its samples are random in position and wavelength. Two seeds tell the noise: the variance of a block of pixels is
estimated from the squared differences of the seeds, pixel by pixel.
"""

from typing import NamedTuple

import numpy as np
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

FINE_NM = np.arange(360.0, 831.0)
# Side of a block, pixels; share of white allowed to the 5 nm grid and our regular sample points at outlines.
BLOCK, ALLOWANCE = 8, 0.001


class Emitter(NamedTuple):
    """A light of Mitsuba's, its power at `FINE_NM`, and the candela, lux or cd/m^2 of ours for 1 of its strength."""

    described: dict
    power: np.ndarray
    strength: float


def spectrum(values, wavelengths_nm=NM):
    """A Mitsuba spectrum, linear between samples and held beyond."""
    listed = ", ".join(f"{value:.9g}" for value in np.interp(FINE_NM, wavelengths_nm, values))
    return {"type": "irregular", "wavelengths": ", ".join(f"{nm:g}" for nm in FINE_NM), "values": listed}


def finely(light):
    """Power of a light at `FINE_NM`, held beyond its own range."""
    return np.interp(FINE_NM, light.spectrum.wavelengths_nm, light.spectrum.samples)


def written(mesh, path):
    """A mesh as PLY with normals, and with texture coordinates if it has any."""
    columns = [mesh.vertices, mesh.normals] + ([] if mesh.uv is None else [mesh.uv])
    rows = np.hstack(columns)
    head = ["ply", "format ascii 1.0", f"element vertex {len(rows)}"]
    head += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz", "u", "v")[: rows.shape[1]]]
    head += [f"element face {len(mesh.faces)}", "property list uchar int vertex_indices", "end_header"]
    lines = [" ".join(f"{value:.9g}" for value in row) for row in rows]
    lines += ["3 " + " ".join(map(str, face)) for face in mesh.faces]
    path.write_text("\n".join([*head, *lines, ""]))
    return {"type": "ply", "filename": str(path)}


def pictures_of(mi, scene, emitter, integrator, bsdfs, folder, count):
    """XYZ (2, H, W, 3) of a scene by Mitsuba, one a seed, of `count` samples a pixel."""
    camera = scene.camera()
    cmfs = np.stack([np.interp(FINE_NM, scene.observer.wavelengths_nm, c) for c in scene.observer.cmfs.T], axis=1)
    film = {"type": "specfilm", "width": camera.width, "height": camera.height_px, "rfilter": {"type": "box"}}
    film |= {name: spectrum(cmfs[:, k], FINE_NM) for k, name in enumerate(("band0_x", "band1_y", "band2_z"))}
    place = mi.ScalarTransform4f().look_at(
        origin=camera.position.tolist(), target=camera.target.tolist(), up=camera.up.tolist()
    )
    if camera.projection == "orthographic":
        sensor = {"type": "orthographic", "to_world": place @ mi.ScalarTransform4f().scale(camera.height / 2)}
    else:
        sensor = {"type": "perspective", "to_world": place, "fov": camera.vertical_fov_deg, "fov_axis": "y"}
        sensor |= {"near_clip": 0.01, "far_clip": 1000.0}
    sensor |= {"film": film, "sampler": {"type": "independent", "sample_count": count}}
    world = {"type": "scene", "integrator": integrator, "sensor": sensor, "light": emitter.described}
    for part in scene.parts:
        world[part.name] = written(part.mesh, folder / f"{part.name}.ply") | {"bsdf": bsdfs[part.material]}
    loaded = mi.load_dict(world)
    scale = np.pi * emitter.strength / scene.viewing.reference_illuminance_lux / (emitter.power @ cmfs[:, 1])
    return np.stack([np.array(mi.render(loaded, seed=seed), dtype=np.float64)[..., :3] * scale for seed in (11, 12)])


def blocks(image):
    """Means (b, 3) over the blocks of an image, row by row."""
    height, width, _ = image.shape
    return image.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3).mean(axis=(1, 3)).reshape(-1, 3)


def apart(ours, theirs):
    """Differences (b, 3) of blocks from the mean of two pictures, and their standard errors by the two."""
    noise = np.sqrt(blocks((theirs[0] - theirs[1]) ** 2)) / 2.0 / BLOCK
    return blocks(ours - theirs.mean(axis=0)), noise


def assert_within_noise(pictures, theirs, record, whole_allowance=ALLOWANCE):
    """Assert that a reference agrees block by block, and as a whole, within the noise of both."""
    ours, noise_words = pictures.xyz[0], "none" if pictures.noise is None else pictures.noise.words
    difference, noise = apart(ours, theirs)
    level = blocks(ours).mean(axis=0)
    whole = difference.mean(axis=0) / level
    record("mean XYZ, of ours and Mitsuba's", (level.tolist(), theirs.mean(axis=(0, 1, 2)).tolist()))
    record("whole picture, relative difference", whole.tolist())
    record("our noise", noise_words)
    print(whole, np.abs(difference).max(), noise.max(), level, noise_words)
    # A pixel of ours is off by about 0.3 % of its XYZ for a ΔE of 0.1, and a block has 64 of them.
    stated = 0.0 if pictures.noise is None else pictures.noise.mean[0]
    own = 4.0 * 0.03 * stated * blocks(ours) / BLOCK
    assert (np.abs(difference) < 4.0 * noise + own + ALLOWANCE).all(), (np.abs(difference) - 4.0 * noise).max()
    # All blocks together are known better than each.
    known = 4.0 * np.sqrt((noise**2).mean(axis=0) / len(noise)) / level
    assert (np.abs(whole) < known + whole_allowance).all(), (whole, known)
