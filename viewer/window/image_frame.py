"""Frame of an image: folded for light and observer if it is spectral, and displayed like scenes."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float, UInt8

from ...calibration.report.statistics import DeltaEStatistics, delta_e_statistics
from ...lighting.environment.environment import mixture
from ...lighting.scene_file.lamps import lamp
from ...runtime.errors import InputError
from ...spectral.observers import observer
from ...spectral.spectrum import Spectrum
from ..display.transform import DisplayTransform
from ..gl.difference_map import DifferencePass
from ..gl.resources import Owner
from .canvas_renderer import Quality
from .display_pass import Showing, Whites, display_of, to_display
from .light_choice import LightChoice
from .spectral_image import SpectralPicture, XyzPicture
from .spectral_image_file import read_looked_at
from .state import Session
from .work import Work, work

if TYPE_CHECKING:
    import moderngl


class ImageFrame:
    """Frame, like `frame.Frame`, that compares an image with another light, observer or image; always exact, in the
    image's size.
    """

    def __init__(self, context: moderngl.Context, image: SpectralPicture | XyzPicture, catalogue: Any) -> None:
        self._context, self._image, self._catalogue = context, image, catalogue
        self._owner = Owner(context)
        self.size: tuple[int, int] = (image.planes.shape[2], image.planes.shape[1])
        self._canvases = self._owner.texture(self.size, 4), self._owner.texture(self.size, 4)
        self._differences = self._owner.texture(self.size, 1)
        self._showing, self._differing = Showing(context), DifferencePass(context)
        self._session: Session | None = None
        self._folded: list[tuple | None] = [None, None]
        self._files: dict[str, SpectralPicture | XyzPicture] = {}
        self._whites: list[Float[np.ndarray, "3"]] = [np.ones(3), np.ones(3)]
        self._drawn, self._counted = 0, (None, None, 0.0)
        self._to_show = False
        self._beyond: UInt8[np.ndarray, "h w"] | None = None
        self.quality, self.reached = Quality.NONE, 0.0
        self.display = DisplayTransform()
        self.problem: str | None = None
        self.texture: moderngl.Texture | None = None
        self.seconds: dict[str, float] = {}

    def release(self) -> None:
        """Free all resources."""
        for one in (self._showing, self._differing, self._owner):
            one.release()
        self.texture = None

    def show(self, session: Session, size: tuple[int, int], moving: bool = False) -> Work:
        """Show a session's image in its own size; on failure `problem` has the reason, and the previous one stays."""
        asked = work(self._session, session)
        if asked == Work.NOTHING:
            self.problem = None
            return asked
        begun = time.perf_counter()
        try:
            display = display_of(session, DisplayTransform())
            for number, whose in enumerate(self._asked(session)):
                self._fold(number, *whose)
            for white in self._whites:
                to_display(white, session.adaptation)
        except InputError as reason:
            self.problem = str(reason)
            return Work.NOTHING
        self.problem, self._session, self.display, self._to_show = None, session, display, True
        self._beyond = None
        self.quality, self.reached = Quality.EXACT, 1.0
        if asked > Work.SHOW:
            self.seconds["light, observer"] = time.perf_counter() - begun
        return asked

    def step(self, seconds: float = 0.05) -> bool:
        """Update the display; nothing remains to be done."""
        if self._to_show and self._session is not None:
            begun = time.perf_counter()
            if self._session.seen == "difference":
                self._differ(self._session)
            self.texture = self._showing.draw(
                self.canvases, self._differences, self.whites, self._session, self.display, self._beyond
            )
            self._to_show = False
            self.seconds["display"] = time.perf_counter() - begun
        return False

    @property
    def compared(self) -> moderngl.Texture | None:
        """XYZ as in `Frame`."""
        return None if self.texture is None else self._showing.compared

    def mark(self, beyond: UInt8[np.ndarray, "h w"]) -> None:
        """Mark pixels as in `Frame`."""
        if beyond is not self._beyond:
            self._beyond, self._to_show = beyond, True

    def statistics(self) -> tuple[DeltaEStatistics | None, float]:
        """Return statistics as in `Frame`."""
        if self._session is None or self.quality != Quality.EXACT:
            return None, 0.0
        compare = self._session.compare
        key = self._drawn, compare.formula, compare.tolerance
        if self._counted[0] != key:
            self._differ(self._session)
            found = self._differing.whole(self._differences, self.canvases, self.whites, compare.formula)
            counted = found[~np.isnan(found)]
            numbers = bool(np.isfinite(counted).any())
            over = float((counted > compare.tolerance).mean()) if numbers else 0.0
            self._counted = key, delta_e_statistics(found) if numbers else None, over
        return self._counted[1:]

    @property
    def whites(self) -> Whites:
        """Whites of A and B."""
        return self._whites[0], self._whites[1]

    @property
    def canvases(self) -> tuple[moderngl.Texture, moderngl.Texture]:
        """XYZ and coverage of A and B."""
        return self._canvases

    def picture(self, session: Session, number: int) -> SpectralPicture | XyzPicture:
        """Return the image of a side, read on first use.

        Raises
        ------
        InputError : it cannot be read, or is of another size.
        """
        file = session.other.file if number else None
        if file is None:
            return self._image
        if file not in self._files:
            found = read_looked_at(file)
            if found.planes.shape[1:] != self._image.planes.shape[1:]:
                height, width = found.planes.shape[1:]
                expected = f"{self.size[0]} x {self.size[1]}, as A has"
                raise InputError(
                    "pictures of different sizes", file=file, found=f"{width} x {height}", expected=expected
                )
            self._files[file] = found
        return self._files[file]

    def light(self, session: Session, choice: LightChoice, who: str) -> Spectrum | None:
        """Return the spectrum of a choice; None for the image's own light.

        Raises
        ------
        InputError, UnknownNameError : an unknown lamp; a booth or a map, which need a scene.
        """
        if choice.booth is not None or choice.map is not None:
            raise InputError("an image has no surfaces that a booth or a map could light", field="light",
                             found=choice.words, expected="a lamp")  # fmt: skip
        if not choice.lamps:
            return None
        folder = Path(session.subject.path or "").parent
        spectra = [lamp(one.name, one.entry, folder, self._catalogue)[0] for one in choice.lamps]
        return mixture(spectra, np.array([one.share for one in choice.lamps], dtype=float), observer(who))

    def _asked(self, session: Session) -> list[tuple[Session, LightChoice, str]]:
        other = session.other
        if other.made == "reference" or other.catalogue is not None:
            raise InputError(
                "an image is not drawn, so that B cannot be either",
                field="B",
                found=f"materials of {other.catalogue}" if other.catalogue else "the reference",
                expected="another light or observer, or another image",
            )
        return [
            (session, session.light, session.observer),
            (session, other.light or session.light, other.observer or session.observer),
        ]

    def _fold(self, number: int, session: Session, choice: LightChoice, who: str) -> None:
        subject = session.subject
        key = choice, who, session.other.file if number else None, subject.own_light, subject.luminance
        if key == self._folded[number]:
            return
        picture = self.picture(session, number)
        own = self.light(session, LightChoice.named(subject.own_light), who) if subject.own_light else None
        light = self.light(session, choice, who)
        found = picture.folded(observer(who), light, own, subject.luminance)
        values = np.empty((*found.values.shape[:2], 4), dtype=np.float32)
        values[..., :3], values[..., 3] = choice.dimming * found.values, picture.coverage
        self._canvases[number].write(values.tobytes())
        self._whites[number] = found.white_xyz
        self._folded[number] = key
        self._drawn += 1

    def _differ(self, session: Session) -> None:
        self._differing.draw(self._differences, self.canvases, self.whites, session.compare.formula)
