"""Cost of spectra a pixel: folded weights beside RGB, and beside spectra carried to the pixel, in one run."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..calibration.report.text_tables import TextTable, text_tables
from ..lighting.camera import Camera
from ..lighting.lights import DirectionalLight
from ..lighting.mesh import shapes
from ..lighting.scene import Part, Scene
from ..materials.core.axes import Axis
from ..materials.factored.pack import FactorPack
from ..spectral.basis import SpectralBasis
from ..spectral.illuminants import illuminant
from ..spectral.observers import observer
from ..spectral.palette import Palette
from ..viewer.gl.backend import GLBackend
from ..viewer.gl.passes import Passes
from ..viewer.gl.resources import Owner, palette_texels
from ..viewer.gl.shaders import program
from ..viewer.render.session import RenderSession

COEFFICIENTS, SAMPLES = 8, 61
FOLDED, RGB = f"{COEFFICIENTS} coefficients, folded", "RGB only"
CARRIED, SAMPLED = f"{COEFFICIENTS} coefficients at the pixel", f"{SAMPLES} samples at the pixel"
# The bar: what folding may cost beside RGB.
BAR = 1.05
PROGRAMS = (
    ("fullscreen.vert", "bench_rgb.frag", {"AXES": 3}),
    *(("fullscreen.vert", "bench_carried.frag", {"AXES": 3, "QUADS": -(-n // 4)}) for n in (COEFFICIENTS, SAMPLES)),
)


@dataclass(frozen=True, eq=False)
class _Way:
    """One way to shade the same picture, and the picture that it draws into."""

    draw: Callable[[], None]
    read: Callable[[], np.ndarray]


def run(size: int = 1024, rank: int = 16, repeats: int = 21, seed: int = 0, backend: GLBackend | None = None) -> dict:
    """Time four ways to shade one lit picture of `size` x `size` pixels with a pack of `rank` terms.

    The geometry (angles, shadows) is worked out before; what is timed is the shading of one layer: look-ups, products
    and the sum over terms, which all ways share, and what each does with the spectrum. The ways take turns; a figure is
    the median of `repeats` turns, each waited for until the device is done.

    Returns
    -------
    dict for JSON: `renderer`, `megapixels` (lit), `rank`, `repeats`, `milliseconds` by way, `over_rgb` by way (median
    of the ratios within a turn), `folded_over_rgb` (one of them), `bar`, and `largest_difference`, relative, of the
    pictures of the spectral ways.

    Raises
    ------
    NoGL : there is no GL to time.
    """
    owns = backend is None
    backend = GLBackend() if backend is None else backend
    session = RenderSession(backend)
    owner = Owner(backend.context)
    passes = Passes(backend.context)
    try:
        ways, lit = _ways(session, backend, passes, owner, size, _pack(rank, seed), seed)
        for way in ways.values():
            way.draw()
        backend.context.finish()
        pictures = {name: way.read() for name, way in ways.items()}
        turns = {name: [] for name in ways}
        names = list(ways)
        for turn in range(repeats):
            # Another one begins each turn, so that none always follows the slowest.
            for name in names[turn % len(names) :] + names[: turn % len(names)]:
                start = time.perf_counter()
                ways[name].draw()
                backend.context.finish()
                turns[name].append(1e3 * (time.perf_counter() - start))
        # Within a turn, because what else the machine does changes from turn to turn.
        over_rgb = {name: float(np.median(np.divide(values, turns[RGB]))) for name, values in turns.items()}
        scale = np.abs(pictures[FOLDED]).max()
        off = max(float(np.abs(pictures[name] - pictures[FOLDED]).max()) for name in (CARRIED, SAMPLED))
        return {
            "renderer": backend.name,
            "megapixels": lit / 1e6,
            "rank": rank,
            "repeats": repeats,
            "milliseconds": {name: float(np.median(values)) for name, values in turns.items()},
            "over_rgb": over_rgb,
            "folded_over_rgb": over_rgb[FOLDED],
            "bar": BAR,
            "largest_difference": off / float(scale),
        }
    finally:
        owner.release()
        passes.release()
        session.release()
        if owns:
            backend.close()


def tables(measured: dict) -> list[TextTable]:
    """(title, header, rows) for people."""
    rows = [
        [name, f"{value:.1f}", f"{value / measured['megapixels']:.1f}", f"{measured['over_rgb'][name]:.2f}"]
        for name, value in measured["milliseconds"].items()
    ]
    verdict = "within" if measured["folded_over_rgb"] <= measured["bar"] else "over"
    title = (
        f"Shading {measured['megapixels']:.2f} lit megapixels, {measured['rank']} terms, {measured['renderer']}; "
        f"folded / RGB = {measured['folded_over_rgb']:.3f}, {verdict} the bar of {measured['bar']}"
    )
    return [(title, ["way", "ms", "ms a megapixel", "of RGB only"], rows)]


def report(measured: dict) -> str:
    """Return the result of `run` as plain text."""
    return text_tables(tables(measured))


def _pack(rank: int, seed: int) -> FactorPack:
    """Random smooth factors: what is timed does not look at the numbers."""
    rng = np.random.default_rng(seed)
    axes = (
        Axis("theta_h", 90, np.pi / 2, "sqrt"),
        Axis("theta_d", 90, np.pi / 2),
        Axis("phi_d", 90, np.pi),
    )
    factors = tuple(0.5 + 0.1 * np.cumsum(rng.normal(size=(axis.size, rank)), axis=0) / axis.size for axis in axes)
    basis = SpectralBasis.sampled(np.linspace(400.0, 700.0, SAMPLES))
    return FactorPack("hd", axes, factors, Palette.of(rng.uniform(0.0, 1.0, (rank, SAMPLES)), basis))


def _scene(size: int) -> Scene:
    """Return a wall that fills the picture, seen and lit at angles that differ from pixel to pixel."""
    wall = shapes.plane(10.0, 10.0)
    camera = Camera(
        "above", (0.3, 3.0, 0.2), (0.0, 0.0, 0.0), vertical_fov_deg=60.0, width=size, height_px=size, samples=1
    )
    light = DirectionalLight(np.array([0.4, 0.8, 0.3]), illuminant("D65"), 1000.0)
    return Scene((Part("wall", wall, "material"),), (light,), (camera,), observer("1931_2"))


def _ways(
    session: RenderSession, backend: GLBackend, passes: Passes, owner: Owner, size: int, pack: FactorPack, seed: int
) -> tuple[dict[str, _Way], float]:
    scene = _scene(size)
    context = backend.context
    (tile,) = (piece.worked_out() for piece in session.windows(scene, scene.camera()))
    _, hd, azimuth = tile.lights[0]
    lit = float(tile.coverage.sum())

    # A basis of 8 that the spectra lie in, so that every spectral way must give the same picture.
    rng = np.random.default_rng(seed)
    fold = scene.observer.weights(scene.lights[0].spectrum, pack.palette.wavelengths_nm).T
    synthesis = np.linalg.qr(rng.normal(size=(SAMPLES, COEFFICIENTS)))[0]
    coefficients = pack.palette.values[0] @ synthesis
    spectra = coefficients @ synthesis.T
    shader = pack.shader()
    shared = {
        "seen": tile.seen,
        "angles": hd,
        "azimuth": azimuth,
        **{name: owner.texels(texels) for name, texels in shader.textures.items()},
    }
    values = {
        "samples": 1,
        "some_samples": (0, 1),
        "rows": -(-pack.rank // 4),
        "part": tile.parts[0][0],
        **shader.uniforms,
    }
    values["palette_shape"] = (1, values["rows"])

    def way(fragment: str, quads: int | None, tables: dict[str, np.ndarray]) -> _Way:
        picture = owner.texture((size, size), 4)
        target = owner.keep(context.framebuffer([picture]))
        textures = {name: owner.texture(table.shape[1::-1], 4, table.tobytes()) for name, table in tables.items()}
        sizes = {"AXES": 3, "MIXED": 1} | ({"SPECTRA": 1} if quads is None else {} if quads == 0 else {"QUADS": quads})
        made = owner.keep(program(context, "fullscreen.vert", fragment, sizes, shader.file))
        everywhere = owner.keep(context.vertex_array(made, []))

        def draw() -> None:
            target.clear()
            passes.draw_layer(made, everywhere, target, (0, 0, size, size), shared | textures, values)

        def read() -> np.ndarray:
            return np.frombuffer(picture.read(), dtype=np.float32).reshape(size, size, 4)[..., :3]

        return _Way(draw, read)

    def carried(terms: np.ndarray, to_xyz: np.ndarray) -> _Way:
        quads = -(-terms.shape[1] // 4)
        padded = np.zeros((len(terms), 4 * quads))
        padded[:, : terms.shape[1]] = terms
        return way("bench_carried.frag", quads, {"weights": _texels(padded), "fold": _texels(to_xyz)})

    return {
        FOLDED: way("shade.frag", None, {"palette": _texels(coefficients @ (synthesis.T @ fold))}),
        RGB: way("bench_rgb.frag", 0, {"weights": _texels(rng.uniform(0.0, 1.0, (pack.rank, 3)))}),
        CARRIED: carried(coefficients, synthesis.T @ fold),
        SAMPLED: carried(spectra, fold),
    }, lit


def _texels(weights: np.ndarray) -> np.ndarray:
    """(rows, columns, 4): columns of `weights` (R, columns), four terms a texel."""
    return palette_texels(weights[None])[0]
