"""Made-up samples: woven cloth, corduroy, leather. Each tiles without a seam and is its seed's alone."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from ...runtime.errors import InputError
from ...spectral.spectrum import Spectrum
from .dyes import dyed, together
from .relief import Relief
from .synthetic import SyntheticBtf
from .transport import CoatGloss

#: Weaves, and after how many yarns each comes back.
WEAVES = {"plain": 2, "twill": 4}
# A yarn's half width, in pitches: a little less than half, so that one sees between yarns.
_RADIUS = 0.46
# Amplitude of a yarn from crossing to crossing, in pitches.
_WAVE = 0.3
# Depth of the valleys between fibres twisted to a yarn, in pitches.
_TWIST = 0.025
# White lobes: of twisted fibres, of the cut ends of a pile, of a polished grain.
_SHEEN, _PILE, _POLISH = CoatGloss(0.08, 30.0), CoatGloss(0.03, 8.0), CoatGloss(0.25, 40.0)


def woven(
    seed: int,
    texels: int = 48,
    *,
    yarns: int = 8,
    weave: str = "twill",
    depth: float = 0.5,
    warp: Spectrum | None = None,
    weft: Spectrum | None = None,
    gloss: CoatGloss = _SHEEN,
    cells: int = 4,
) -> SyntheticBtf:
    """Cloth of dyed yarns: warp of one dye along v, weft of another along u.

    texels : along each side of the tile. yarns : of each kind across it; a multiple of 2 (plain) or 4 (2/2 twill).
    depth : 1 where yarns are round and lie loosely, less where they are pressed flat.
    warp, weft : reflectances (P,L) of a yarn's places, by chance and smoothly along it; one each is even. None: madder
    and indigo of twelve strengths each.
    cells : along a side of a texel; facets are half of one. The rest: `dataclasses.replace` (`SyntheticBtf`).

    Raises
    ------
    InputError : a weave there is none of, or one that does not come out even over the tile.
    """
    period = WEAVES.get(weave)
    if period is None:
        raise InputError("an unknown weave", field="weave", found=weave, expected=", ".join(WEAVES))
    if yarns < period or yarns % period:
        raise InputError("a weave that does not tile", field="yarns", found=yarns, expected=f"a multiple of {period}")
    _check(texels, cells)
    random = np.random.default_rng(seed)
    across, along = _middles(texels, cells, yarns)
    i, j = np.ogrid[:yarns, :yarns]
    over = (i + j) % 2 == 0 if weave == "plain" else (i - j) % 4 < 2
    warp_height = _yarn(across, along, over, random)
    weft_height = _yarn(along, across, ~over.T, random)
    is_weft = weft_height > warp_height
    pitch = texels / yarns
    heights = np.maximum(np.maximum(warp_height, weft_height), -_RADIUS) * (pitch * depth)
    strengths = np.linspace(0.25, 1.8, 12)
    warp = dyed("madder", strengths) if warp is None else warp
    weft = dyed("indigo", strengths) if weft is None else weft
    places = [
        _places(across, along, len(warp.samples), yarns, random),
        len(warp.samples) + _places(along, across, len(weft.samples), yarns, random),
    ]
    dye = np.where(is_weft, places[1], places[0])
    yarn = np.where(is_weft[..., None], np.array([1.0, 0.0]), np.array([0.0, 1.0]))
    relief = Relief(heights, dye, (texels, texels), yarn)
    dyes = together(warp, weft)
    return SyntheticBtf(relief, dyes, gloss, seed=seed)


def corduroy(
    seed: int,
    texels: int = 48,
    *,
    wales: int = 4,
    depth: float = 5.0,
    dyes: Spectrum | None = None,
    gloss: CoatGloss = _PILE,
    cells: int = 4,
) -> SyntheticBtf:
    """Ridges of cut pile along v, `wales` across the tile and `depth` texels high, tufted at random.

    dyes : reflectances (P,L), from the roots to the tips of the pile. None: walnut, worn at the tips. See `woven`.
    """
    _check(texels, cells)
    random = np.random.default_rng(seed)
    across, _ = _middles(texels, cells, wales)
    wander = 0.03 * _noise(texels * cells, 0.5 * texels / wales * cells, random)
    ridge = np.abs(np.sin(np.pi * (across + wander))) ** 0.7
    tufts = _noise(texels * cells, 0.8 * cells, random)
    heights = depth * ridge + (0.15 + 0.45 * ridge) * tufts
    if dyes is None:
        dyes = dyed("walnut", [2.6, 2.3, 2.0, 1.7, 1.3])
    share = np.clip(heights / depth + 0.1 * _noise(texels * cells, 1.5 * cells, random), 0.0, 0.999)
    dye = np.floor(share * len(dyes.samples)).astype(np.int64)
    relief = Relief(heights, dye, (texels, texels))
    return SyntheticBtf(relief, dyes, gloss, seed=seed)


def leather(
    seed: int,
    texels: int = 48,
    *,
    pebbles: int = 60,
    depth: float = 1.5,
    dyes: Spectrum | None = None,
    gloss: CoatGloss = _POLISH,
    cells: int = 4,
) -> SyntheticBtf:
    """Grain of `pebbles` bulges with creases between them (Worley 1996), `depth` texels deep.

    dyes : reflectances (P,L), from the creases to the tops. None: madder and walnut, darker in creases. See `woven`.
    """
    _check(texels, cells)
    random = np.random.default_rng(seed)
    side = texels * cells
    middles = random.random((pebbles, 2))
    # The two nearest middles of each place, on a tile that goes on over its edges.
    near = np.full((2, side, side), np.inf)
    y, x = np.mgrid[:side, :side] / side
    for v, u in middles:
        off = np.hypot((y - v + 0.5) % 1.0 - 0.5, (x - u + 0.5) % 1.0 - 0.5)
        near[1] = np.minimum(near[1], np.maximum(near[0], off))
        near[0] = np.minimum(near[0], off)
    gap = (near[1] - near[0]) * np.sqrt(pebbles) if pebbles > 1 else np.ones((side, side))
    bulge = 1.0 - np.exp(-4.0 * gap)
    heights = depth * bulge + 0.08 * _noise(side, 0.7 * cells, random) + 0.15 * _noise(side, 3.0 * cells, random)
    if dyes is None:
        dyes = together(dyed("walnut", [4.0, 3.2]), dyed("madder", [2.2, 1.9, 1.6]))
    share = np.clip(bulge + 0.08 * _noise(side, 2.0 * cells, random), 0.0, 0.999)
    dye = np.floor(share * len(dyes.samples)).astype(np.int64)
    return SyntheticBtf(Relief(heights, dye, (texels, texels)), dyes, gloss, seed=seed)


def flat(texels: int, dyes: Spectrum, *, depth: float = 0.0, cells: int = 1, seed: int = 0) -> SyntheticBtf:
    """Return a plane of dyes, a square each by chance, `depth` texels below the measured plane: each texel is
    Lambert's.
    """
    _check(texels, cells)
    dye = np.random.default_rng(seed).integers(0, len(dyes.samples), (texels, texels))
    dye = np.kron(dye, np.ones((cells, cells), dtype=np.int64))
    return SyntheticBtf(Relief(np.zeros(dye.shape), dye, (texels, texels)), dyes, plane=depth, seed=seed)


def _check(texels: int, cells: int) -> None:
    for field, value in (("texels", texels), ("cells", cells)):
        if value < 1:
            raise InputError("nothing that could be traced", field=field, found=value, expected="1 or more")


def _middles(texels: int, cells: int, pitches: int) -> tuple[Float[np.ndarray, "S S"], Float[np.ndarray, "S S"]]:
    """Places of the map of heights along u and along v, in pitches."""
    side = texels * cells
    at = np.arange(side) * (pitches / side)
    u, v = np.meshgrid(at, (pitches - at) % pitches)
    return u, v


def _yarn(
    across: Float[np.ndarray, "S S"],
    along: Float[np.ndarray, "S S"],
    over: Bool[np.ndarray, "n n"],
    random: np.random.Generator,
) -> Float[np.ndarray, "S S"]:
    """Heights of yarns in pitches, far down between them; over[i, j] says whether yarn i is above at crossing j."""
    count = len(over)
    phase = random.random(count)
    swing = random.random(count)
    sway = 0.04 * np.sin(2.0 * np.pi * (along / count + swing[np.floor(across).astype(np.int64) % count]))
    across = across + sway
    number = np.floor(across).astype(np.int64) % count
    off = across - np.floor(across) - 0.5
    # Half a wave from one crossing to the next; their middles are at halves.
    place = along - 0.5
    before = np.floor(place).astype(np.int64)
    share = 0.5 - 0.5 * np.cos(np.pi * (place - before))
    sign = np.where(over, 1.0, -1.0)
    level = (1.0 - share) * sign[number, before % count] + share * sign[number, (before + 1) % count]
    arch = np.sqrt(np.maximum(_RADIUS**2 - off**2, 0.0))
    twist = _TWIST * np.cos(2.0 * np.pi * (4.0 * along + 2.5 * off + phase[number]))
    return np.where(np.abs(off) < _RADIUS, _WAVE * level + arch + twist, -np.inf)


def _places(
    across: Float[np.ndarray, "S S"],
    along: Float[np.ndarray, "S S"],
    dyes: int,
    count: int,
    random: np.random.Generator,
) -> Int[np.ndarray, "S S"]:
    """Choose which of its dyes each place of a yarn has: smooth along it, and another for each yarn."""
    number = np.floor(across).astype(np.int64) % count
    turns = random.integers(1, 4, (2, count))
    start = random.random((2, count))
    wave = sum(np.sin(2.0 * np.pi * (turns[k][number] * along / count + start[k][number])) for k in range(2))
    return np.clip(np.floor((0.5 + 0.25 * wave) * dyes), 0, dyes - 1).astype(np.int64)


def _noise(side: int, width: float, random: np.random.Generator) -> Float[np.ndarray, "S S"]:
    """Noise of variance 1 that tiles, smooth over `width` cells."""
    frequency = np.fft.fftfreq(side)
    pass_band = np.exp(-2.0 * (np.pi * width) ** 2 * (frequency[:, None] ** 2 + frequency**2))
    noise = np.fft.ifft2(np.fft.fft2(random.normal(size=(side, side))) * pass_band).real
    spread = noise.std()
    return (noise - noise.mean()) / spread if spread > 0.0 else np.zeros((side, side))
