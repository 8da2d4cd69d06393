"""The picture in the middle, on its surround, pixel for pixel; and what the mouse does on it."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import ImVec2, imgui

from ..commands import Dial
from ..frame import Frame
from ..numeric_controls import POSITION
from ..places import Region, free_name
from ..viewpoint import orbited, panned, zoomed
from .lens import Lens
from .overlays import draw_overlays
from .widgets import em
from .window import Window

# Degrees that dragging over the height of the picture orbits, and what a notch of the wheel zooms.
_ORBIT_DEG, _WHEEL = 180.0, 1.15
# Distance from the wipe's line at which the mouse takes it, sizes of text; and pixels of a click that is no drag.
_GRAB, _STILL = 0.5, 4.0


class PictureArea:
    """The area of the picture: what is being dragged on it, and how an image lies in it."""

    def __init__(self) -> None:
        self._dragged: str | None = None
        self._from = ImVec2(0.0, 0.0)
        self.region: tuple[float, float, float, float] | None = None
        self.lens = Lens()

    def draw(self, window: Window, corner: ImVec2, room: ImVec2) -> None:
        """Fill `room` at `corner` of the screen: the picture in its middle, as large as there is room."""
        scale = imgui.get_io().display_framebuffer_scale
        scale = scale.x if scale.x > 0.0 else 1.0
        margin = em(0.8)
        across, along = (max(0, int((side - 2.0 * margin) * scale)) for side in (room.x, room.y))
        pixels = window.size = across, along
        frame = window.frame
        if frame is None or frame.texture is None or min(pixels) < 1:
            if min(pixels) > 50:
                imgui.set_cursor_screen_pos(ImVec2(corner.x + margin, corner.y + margin))
                imgui.text_disabled("The picture is being prepared.")
            return
        if isinstance(frame, Frame):
            place = self.lens.whole(frame.texture.size, pixels)
        else:
            place = self.lens.placed(frame.texture.size, pixels)
        left = corner.x + margin + place.left / scale
        top = corner.y + margin + place.top / scale
        imgui.set_cursor_screen_pos(ImVec2(left, top))
        size = ImVec2(place.width / scale, place.height / scale)
        imgui.image(imgui.ImTextureRef(frame.texture.glo), size, ImVec2(*place.uv[:2]), ImVec2(*place.uv[2:]))
        imgui.set_cursor_screen_pos(ImVec2(left, top))
        imgui.set_next_item_allow_overlap()
        buttons = imgui.ButtonFlags_
        imgui.invisible_button(
            "picture", size, buttons.mouse_button_left | buttons.mouse_button_right | buttons.mouse_button_middle
        )
        to_pixel = place.pixel_of
        mouse = imgui.get_mouse_pos()
        at = to_pixel((mouse.x - left) * scale, (mouse.y - top) * scale)
        hovered = imgui.is_item_hovered()
        window.point_at((int(at[0]), int(at[1])) if hovered and place.holds(at) else None)
        self._mouse(window, at, place.seen_size, hovered, frame)
        draw_overlays(window, ImVec2(left, top), size, place, scale, self.region)

    def _mouse(
        self, window: Window, at: tuple[float, float], size: tuple[int, int], hovered: bool, frame: object
    ) -> None:
        io, desk = imgui.get_io(), window.desk
        active = imgui.is_item_active()
        if imgui.is_item_activated():
            self._from = imgui.get_mouse_pos()
            self._dragged = self._begun(window, at, size)
        moved = io.mouse_delta
        if active and self._dragged and (moved.x or moved.y):
            self._drag(window, at, size, moved, isinstance(frame, Frame))
        if imgui.is_item_deactivated():
            if self._dragged == "region" and self.region is not None:
                self._add_region(window)
            elif self._dragged == "orbit" and self._is_click():
                pass
            elif self._dragged == "pin" and self._is_click():
                window.pin_pointer()
            self._dragged, self.region = None, None
        window.moving = active and self._dragged in ("orbit", "pan")
        if hovered and io.mouse_wheel and not io.key_ctrl:
            if isinstance(frame, Frame):
                factor = _WHEEL**io.mouse_wheel
                desk.do(lambda session: replace(session, view=zoomed(session.view, factor)), "Zoom", stroke="wheel")
            else:
                self.lens.zoom(_WHEEL**io.mouse_wheel, at)

    def _begun(self, window: Window, at: tuple[float, float], size: tuple[int, int]) -> str:
        io, session = imgui.get_io(), window.desk.session
        if io.key_shift:
            return "pin"
        if io.key_ctrl:
            self.region = (*at, *at)
            return "region"
        if imgui.is_mouse_down(1) or imgui.is_mouse_down(2):
            return "pan"
        line = session.compare.position * size[0]
        if session.seen == "wipe" and abs(at[0] - line) < em(_GRAB) * imgui.get_io().display_framebuffer_scale.x:
            return "wipe"
        return "orbit"

    def _drag(
        self, window: Window, at: tuple[float, float], size: tuple[int, int], moved: ImVec2, is_scene: bool
    ) -> None:
        desk, scale = window.desk, imgui.get_io().display_framebuffer_scale.x
        right, down = moved.x * scale / size[1], moved.y * scale / size[1]
        if self._dragged == "wipe":
            _put_dial(window, POSITION, at[0] / size[0])
        elif self._dragged == "region" and self.region is not None:
            self.region = (*self.region[:2], *at)
        elif self._dragged == "pin":
            return
        elif not is_scene:
            self.lens.move(moved.x * scale, moved.y * scale)
        elif self._dragged == "orbit":
            desk.do(
                lambda session: replace(session, view=orbited(session.view, -_ORBIT_DEG * right, _ORBIT_DEG * down)),
                "Orbit",
                stroke="orbit",
            )
        else:
            desk.do(lambda session: replace(session, view=panned(session.view, -right, down)), "Pan", stroke="pan")

    def _is_click(self) -> bool:
        now = imgui.get_mouse_pos()
        return abs(now.x - self._from.x) < _STILL and abs(now.y - self._from.y) < _STILL

    def _add_region(self, window: Window) -> None:
        assert self.region is not None
        width, height = window.shown_size
        left, right = (min(max(value / width, 0.0), 1.0) for value in sorted((self.region[0], self.region[2])))
        top, bottom = (min(max(value / height, 0.0), 1.0) for value in sorted((self.region[1], self.region[3])))
        if right - left < 1.0 / width or bottom - top < 1.0 / height:
            return
        name = free_name("region", window.desk.session.regions)

        def add(session):
            return replace(session, regions=(*session.regions, Region(name, left, top, right, bottom)))

        window.desk.do(add, f"Add {name}")


def _put_dial(window: Window, dial: Dial, value: float) -> None:
    window.desk.turn(dial, value)
