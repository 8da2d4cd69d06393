"""The profile that an X server has for its screen: put there as colour managers do, and read back."""

import ctypes
import ctypes.util

import pytest
from icc_profiles import old_tables
from metamer.runtime.errors import InputError
from metamer.viewer.display.screen_profile import screen_profile
from metamer.viewer.display.transform import DisplayTransform

pytestmark = pytest.mark.window
# An atom that every server has, and the way of writing that takes the place of what was there.
_CARDINAL, _REPLACES = 6, 0


@pytest.fixture
def put(display):
    """Sets the property `_ICC_PROFILE` of the root window, which nobody needs to stay for."""
    x11 = ctypes.CDLL(ctypes.util.find_library("X11"))
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XDefaultRootWindow.restype = x11.XInternAtom.restype = ctypes.c_ulong
    server = ctypes.c_void_p(x11.XOpenDisplay(display.encode()))
    root = ctypes.c_ulong(x11.XDefaultRootWindow(server))
    name = ctypes.c_ulong(x11.XInternAtom(server, b"_ICC_PROFILE", False))

    def run(data):
        x11.XChangeProperty(server, root, name, ctypes.c_ulong(_CARDINAL), 8, _REPLACES, data, len(data))
        x11.XSync(server, False)

    yield run
    x11.XDeleteProperty(server, root, name)
    x11.XSync(server, False)
    x11.XCloseDisplay(server)


def test_of_the_first_screen(display, put, monkeypatch):
    monkeypatch.setenv("DISPLAY", display)
    with pytest.raises(InputError, match="does not say which profile"):
        screen_profile()
    data = old_tables(name="On the wall")
    put(data)
    assert screen_profile() == data
    assert DisplayTransform("icc:screen").name == "ICC: On the wall"
    put(b"no profile at all" * 20)
    with pytest.raises(InputError, match="icc:screen: its first bytes: not an ICC profile"):
        DisplayTransform("icc:screen")


def test_without_a_server_that_answers(monkeypatch):
    monkeypatch.setenv("DISPLAY", ":4711")
    with pytest.raises(InputError, match="name the file: icc:FILE"):
        screen_profile()
