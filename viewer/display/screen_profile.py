"""ICC profile of the screen, from the X server or Windows."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import sys

from ...calibration.display.icc_profile import SCREEN
from ...runtime.errors import InputError

# Length limit in units of four bytes, larger than any profile.
_LONGEST = 1 << 24


def screen_profile() -> bytes:
    """Return the profile of the first screen.

    Raises
    ------
    InputError : a system without one, or that does not provide it.
    """
    if sys.platform == "win32":
        from PIL import ImageCms

        found = ImageCms.get_display_profile()
        data = None if found is None else found.tobytes()
    elif os.environ.get("DISPLAY"):
        data = _of_x_server()
    else:
        data = None
    if not data:
        raise InputError(
            "the system does not say which profile its screen has",
            field="display",
            found=f"no profile for {SCREEN}",
            expected="Windows, or an X server with the property _ICC_PROFILE",
            hint="name the file: icc:FILE (colormgr, xiccd and system settings say where it is)",
        )
    return data


def _of_x_server() -> bytes | None:
    """Return the property `_ICC_PROFILE` of the root window (ICC Profiles in X, 0.4); None without one."""
    path = ctypes.util.find_library("X11")
    if path is None:
        return None
    x11 = ctypes.CDLL(path)
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XDefaultRootWindow.restype = x11.XInternAtom.restype = ctypes.c_ulong
    x11.XDefaultRootWindow.argtypes = x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    x11.XInternAtom.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int]
    x11.XFree.argtypes = [ctypes.c_void_p]
    long, whole = ctypes.c_long, ctypes.c_ulong
    x11.XGetWindowProperty.argtypes = [ctypes.c_void_p, whole, whole, long, long, ctypes.c_int, whole,
                                       *[ctypes.c_void_p] * 5]  # fmt: skip
    server = x11.XOpenDisplay(None)
    if not server:
        return None
    try:
        # The atom is not created if it does not exist.
        name = x11.XInternAtom(server, b"_ICC_PROFILE", True)
        if not name:
            return None
        kind, bits, count, rest = whole(), ctypes.c_int(), whole(), whole()
        content = ctypes.c_void_p()
        x11.XGetWindowProperty(server, x11.XDefaultRootWindow(server), name, 0, _LONGEST, False, 0, ctypes.byref(kind),
                               ctypes.byref(bits), ctypes.byref(count), ctypes.byref(rest),
                               ctypes.byref(content))  # fmt: skip
        if not content.value:
            return None
        try:
            return ctypes.string_at(content.value, count.value) if bits.value == 8 else None
        finally:
            x11.XFree(content)
    finally:
        x11.XCloseDisplay(server)
