"""Small BTFs for tests: images in memory, and files as UBO2003 and UTIA name them."""

import runpy

import numpy as np
import pytest
from metamer.materials.btf.decoding import uplifted_basis
from metamer.materials.btf.hemisphere import Hemisphere
from metamer.materials.btf.images import HeldImages
from metamer.materials.formats.btf_names import directions_of

#: Nine directions: the normal, four at 30 degrees, four at 60.
NINE = [(0, 0)] + [(theta, phi) for theta in (30, 60) for phi in range(0, 360, 90)]
RINGS = ((0, 360), (15, 60), (30, 30), (45, 20), (60, 18), (75, 15))
UBO = [(theta, phi) for theta, step in RINGS for phi in range(0, 360, step)]


def held(views=NINE, lights=NINE, size=(3, 5), seed=0, **more):
    """Random images in memory, darker where light is low."""
    rng = np.random.default_rng(seed)
    directions = directions_of(lights)
    values = rng.uniform(0.05, 0.3, (len(views), len(lights), *size, 3)) * directions[None, :, None, None, 2:]
    basis = uplifted_basis()
    return HeldImages(
        Hemisphere(directions_of(views)), Hemisphere(directions), values.astype(np.float32), basis, **more
    )


def written(
    folder, views=NINE, lights=NINE, size=(4, 4), name="{n:05d} tl{tl:03d} pl{pl:03d} tv{tv:03d} pv{pv:03d}.png"
):
    """Random 8-bit images; returns their codes (V,Lt,H,W,3)."""
    from PIL import Image

    codes = np.random.default_rng(1).integers(20, 236, (len(views), len(lights), *size, 3)).astype(np.uint8)
    n = 0
    for v, (tv, pv) in enumerate(views):
        for at, (tl, pl) in enumerate(lights):
            n += 1
            path = folder / name.format(n=n, v=v, tl=tl, pl=pl, tv=tv, pv=pv)
            path.parent.mkdir(parents=True, exist_ok=True)
            Image.fromarray(codes[v, at]).save(path)
    return codes


def xml3d_btf(folder, name):
    """A measured cloth, by the script that lies beside it; run as text, so that no byte code is left among the data."""
    if not (folder / name).is_dir():
        pytest.skip(f"no {folder / name}")
    return runpy.run_path(str(folder / "decode.py"))["Xml3dBtf"](folder / name)
