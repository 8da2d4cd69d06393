"""Display pass on the GPU: comparison of canvases over their surround, adaptation, and OpenColorIO."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, UInt8

from ...calibration.display.icc_profile import PREFIX
from ...calibration.report import plots
from ...spectral.adaptation import adaptation_matrix
from ...spectral.difference import xyz_from_lab
from ...spectral.srgb import srgb_to_linear
from ...spectral.upsampling import xyz_from_rgb
from ..display.gl_pass import DisplayPass
from ..display.proof import proof_of
from ..display.transform import CLIP_TOLERANCE, DEFAULT_VIEW, DISPLAY_WHITE_XYZ, DisplayTransform
from ..gl.difference_map import column_major
from ..gl.full_screen import FullScreen
from ..gl.live import Box
from ..gl.programs import Programs
from ..gl.resources import Owner, release_target
from .state import MODES, Adaptation, Session

if TYPE_CHECKING:
    import moderngl

#: Width of a warning's stripes in pixels, a quarter each: red above, blue or green below.
STRIPE = 3
Whites = tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]


class Showing:
    """Display pass of two canvases of one size in a session's comparison mode; `shown` has the display's codes (RGBA8).

    Raises
    ------
    InputError, UnknownNameError : an unusable display transform.
    """

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        self._owner, self._sized = Owner(context), Owner(context)
        self._compare = {kind: FullScreen(context, "compare.frag", {kind: 1}) for kind in ("ONE", "TWO", "MAP")}
        self._scale = self._owner.texels(_scale_xyz()[None])
        self._marked = FullScreen(context, "marked.frag")
        self._passes: dict[tuple[DisplayTransform, bool], DisplayPass] = {}
        self._spare: list[moderngl.Texture] = []
        self._beyond: moderngl.Texture | None = None
        self._textures: tuple[moderngl.Texture, moderngl.Texture] | None = None

    def release(self) -> None:
        """Free all resources."""
        self._sized.release()
        for one in self._compare.values():
            one.release()
        self._marked.release()
        self._owner.release()

    @property
    def all_programs(self) -> list[Programs]:
        """Return the programs that it draws with, except OpenColorIO's own."""
        return [one.programs for one in (*self._compare.values(), self._marked)]

    def draw(
        self,
        canvases: tuple[moderngl.Texture, moderngl.Texture],
        differences: moderngl.Texture,
        whites: Whites,
        session: Session,
        display: DisplayTransform,
        beyond: UInt8[np.ndarray, "h w"] | None = None,
        boxes: Sequence[Box] | None = None,
    ) -> moderngl.Texture:
        """Draw the display's codes, rows from the top; valid until the next call.

        differences : from `DifferencePass`; used only if the session shows their map.
        beyond : for a display that `needs_beyond`, the result of `queries.beyond` for `compared`; None marks nothing.
        boxes : the only pixels of the canvases that changed since the last call, with all else unchanged; None draws
        everything.
        """
        size = canvases[0].size
        xyz_d65, shown = self._targets(size)
        compare = session.compare
        # In these modes a pixel depends on other pixels of the canvases.
        boxes = [(0, 0, *size)] if boxes is None or session.seen in ("difference", "side by side") else boxes
        kind = {"A": "ONE", "B": "ONE", "difference": "MAP"}.get(session.seen, "TWO")
        only = int(session.seen == "B")
        seen = {"first": canvases[only], "second": canvases[1], "differences": differences, "scale": self._scale}
        values: dict[str, object] = {
            "adapt_first": column_major(to_display(whites[only], session.adaptation)),
            "adapt_second": column_major(to_display(whites[1], session.adaptation)),
            "exposure": 2.0**session.exposure,
            "surround": tuple(surround_xyz(session.surround)),
            "mode": MODES.index(session.seen),
            "position": compare.position * size[0],
            "cell": max(1, round(compare.cell * size[1])),
            "largest": compare.scale,
            "tolerance": compare.tolerance if compare.contour else -1.0,
            "contour": _contour_xyz(compare.tolerance / compare.scale),
        }
        tabled = needs_beyond(session, display)
        sides = self._sides(size, beyond) if tabled else None
        for box in boxes:
            self._compare[kind].draw(xyz_d65, seen, values, box)
            self._send(xyz_d65, session, display, sides, shown, box)
        return shown

    def _send(
        self,
        xyz_d65: moderngl.Texture,
        session: Session,
        display: DisplayTransform,
        sides: moderngl.Texture | None,
        shown: moderngl.Texture,
        box: Box,
    ) -> None:
        """Encode some pixels, with a session's soft proof and warnings. sides : of the gamut, by tables."""
        size = xyz_d65.size
        # Colours of a ΔE map are not scene colours.
        coloured = session.seen != "difference"
        proof = proof_of(display, session.shown.proof) if coloured else None
        limited, asked, xyz = None, display, xyz_d65
        if proof is not None:
            asked = proof.of
            limited = self._encoded(xyz_d65, proof.of, self._float(0, size), box)
            xyz_d65 = self._encoded(limited, proof.of, self._float(1, size), box, back=True)
        if not (session.shown.gamut_warning and coloured):
            self._encoded(xyz_d65, display, shown, box)
            return
        sent = self._encoded(xyz_d65, display, self._float(2, size), box)
        black = {"black": max(asked.black_y, -1e30)}
        numbers = {"tolerance": CLIP_TOLERANCE, "stripe": STRIPE, "tabled": sides is not None} | black
        samplers = {"sent": sent, "limited": limited or sent, "xyz": xyz} | ({} if sides is None else {"beyond": sides})
        self._marked.draw(shown, samplers, numbers, box)

    def _sides(self, size: tuple[int, int], beyond: UInt8[np.ndarray, "h w"] | None) -> moderngl.Texture:
        if self._beyond is None:
            self._beyond = self._sized.texture(size, 1, dtype="f1")
        self._beyond.write(bytes(size[0] * size[1]) if beyond is None else np.ascontiguousarray(beyond).tobytes())
        return self._beyond

    def _encoded(
        self, taken: moderngl.Texture, display: DisplayTransform, onto: moderngl.Texture, box: Box, back: bool = False
    ) -> moderngl.Texture:
        if (display, back) not in self._passes:
            self._passes[display, back] = DisplayPass(self._context, display, back)
        target = self._context.framebuffer([onto])
        try:
            self._passes[display, back].draw(taken, target, box)
        finally:
            release_target(target)
        return onto

    def _float(self, number: int, size: tuple[int, int]) -> moderngl.Texture:
        """Return one of a few intermediate canvases, created on first use."""
        while len(self._spare) <= number:
            self._spare.append(self._sized.texture(size, 4))
        return self._spare[number]

    def check(self, display: DisplayTransform, session: Session) -> None:
        """Raise the errors of `draw` in advance."""
        _ = display.processor
        if (proof := proof_of(display, session.shown.proof)) is not None:
            _ = proof.of.inverse

    @property
    def compared(self) -> moderngl.Texture:
        """XYZ under the display's white, as drawn last."""
        assert self._textures is not None
        return self._textures[0]

    def _targets(self, size: tuple[int, int]) -> tuple[moderngl.Texture, moderngl.Texture]:
        if self._textures is None or self._textures[0].size != size:
            self._sized.release()
            self._spare.clear()
            self._beyond = None
            self._textures = self._sized.texture(size, 4), self._sized.texture(size, 4, dtype="f1")
        return self._textures


def needs_beyond(session: Session, display: DisplayTransform) -> bool:
    """Return whether the gamut warning of a session needs `queries.beyond`, since tables limit codes to the gamut."""
    if not session.shown.gamut_warning or session.seen == "difference" or session.shown.proof:
        return False
    return display.profile is not None and display.profile.has_limits


def to_display(white: Float[np.ndarray, "3"], adaptation: Adaptation) -> Float[np.ndarray, "3 3"]:
    """Return the matrix from XYZ under a white to OpenColorIO's XYZ."""
    return adaptation_matrix(white, DISPLAY_WHITE_XYZ, adaptation.method, adaptation.degree)  # pyright: ignore


def surround_xyz(lightness: float) -> Float[np.ndarray, "3"]:
    """Return XYZ of the grey of this L*, under the display's white."""
    return xyz_from_lab(np.array([lightness, 0.0, 0.0]), DISPLAY_WHITE_XYZ)


def display_of(session: Session, scene_display: DisplayTransform) -> DisplayTransform:
    """Return the display of a session, with defaults from the scene's, aimed for the observer of side A.

    Raises
    ------
    InputError, UnknownNameError : see `DisplayTransform`.
    """
    shown = session.shown
    display = shown.display or ("" if shown.config else scene_display.display)
    # A profile is complete; a scene's configuration and view belong to other displays.
    alone = display.startswith(PREFIX) and display != scene_display.display
    return DisplayTransform(
        display,
        shown.view or (DEFAULT_VIEW if alone else scene_display.view),
        shown.config or (None if alone else scene_display.config),
        scene_display.adaptation,
        session.observer,
    )


def map_colour(share: float) -> tuple[int, int, int]:
    """Return the colour of a ΔE map at a share of its scale, sRGB."""
    table = plots.scale_rgb()
    red, green, blue = table[min(int(share * len(table)), len(table) - 1)] if share <= 1.0 else plots.OVER_RGB
    return int(red), int(green), int(blue)


def _scale_xyz() -> Float[np.ndarray, "steps 4"]:
    """Return the colours of the scale's steps, of values beyond it, and of invalid ones."""
    codes = np.concatenate([plots.scale_rgb(), [plots.OVER_RGB, plots.UNDEFINED_RGB]]) / 255.0
    return np.pad(srgb_to_linear(codes) @ xyz_from_rgb().T, ((0, 0), (0, 1))).astype(np.float32)


def _contour_xyz(share: float) -> tuple[float, ...]:
    """Return white on the scale's dark half, black on its light one."""
    return tuple(DISPLAY_WHITE_XYZ) if share < 0.6 else (0.0, 0.0, 0.0)
