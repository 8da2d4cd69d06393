"""Image of a session's subject on the GPU; the last valid one stays while another fails."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...runtime.errors import MetamerError
from .frame import Frame
from .image_frame import ImageFrame
from .session_loader import Loaded
from .sides import SessionObjects
from .state import Session

if TYPE_CHECKING:
    import moderngl


class Pictures:
    """Owner of a `Frame` or an `ImageFrame`, replaced when another subject is loaded.

    Attributes
    ----------
    frame : current one, or None. problem : reason why the session is not shown.
    """

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context
        self._asked: tuple | None = None
        self._new: Frame | ImageFrame | None = None
        # Replacement of the frame's scene, at the next session that can be shown.
        self._turned: Loaded | None = None
        self.frame: Frame | ImageFrame | None = None
        self.problem: str | None = None

    def release(self) -> None:
        """Free all resources."""
        for one in (self.frame, self._new):
            if one is not None:
                one.release()
        self.frame = self._new = None

    def read_shaders_again(self) -> str | None:
        """Recompile the shaders of a scene's frame; return the reason if one does not compile, in which case all
        stay.
        """
        return self.frame.read_shaders_again() if isinstance(self.frame, Frame) else None

    def put(self, loaded: Loaded) -> None:
        """Set the subject; the previous image stays until the new one can be shown."""
        if self._new is not None:
            self._new.release()
            self._new = None
        self._asked = self._turned = None
        try:
            if isinstance(self.frame, Frame) and loaded.scene is not None:
                self._turned = loaded
            elif loaded.image is not None:
                self._new = ImageFrame(self._context, loaded.image, loaded.catalogue)
            else:
                self._new = Frame(self._context, _sources(loaded))
        except MetamerError as reason:
            # A shader that does not compile.
            self.problem = str(reason)

    def show(self, session: Session, size: tuple[int, int], moving: bool) -> None:
        """Show a session's image at a size in pixels."""
        if min(size) < 1:
            return
        asked = session, size, moving
        if asked == self._asked:
            return
        self._asked = asked
        frame = self._new or self.frame
        if frame is None:
            return
        try:
            if self._turned is not None and isinstance(self.frame, Frame):
                if not self.frame.turn_to(_sources(self._turned), session, size):
                    self.problem = self.frame.problem
                    return
                self._turned = None
            frame.show(session, size, moving)
        except MetamerError as reason:
            # A shader that does not compile, or lack of memory: the previous image stays.
            self.problem = str(reason)
            return
        self.problem = frame.problem
        if self._new is not None and frame.problem is None:
            if self.frame is not None:
                self.frame.release()
            self.frame, self._new = self._new, None

    def step(self, seconds: float) -> bool:
        """Work for about `seconds`; return whether more remains."""
        if self.frame is None:
            return False
        try:
            more = self.frame.step(seconds)
        except MetamerError as reason:
            self.problem = str(reason)
            return False
        if self._new is None and self._turned is None:
            self.problem = self.frame.problem
        return more


def _sources(loaded: Loaded) -> SessionObjects:
    assert loaded.scene is not None
    return SessionObjects(loaded.scene, loaded.catalogue)
