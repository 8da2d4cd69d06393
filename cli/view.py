"""`metamer view`: the review window."""

from __future__ import annotations

import argparse
import os
from dataclasses import replace
from importlib import import_module
from pathlib import Path

from ..runtime.distribution import install_hint, system_hint
from ..runtime.errors import InputError
from ..runtime.remote import local_folder
from .options import add_catalogue_option, add_display_option, catalogue_for, check_display_option

# Packages of these libraries in Debian and Ubuntu.
_LIBRARIES = ("libx11-6", "libxext6", "libxcursor1", "libxi6", "libxinerama1", "libxrandr2", "libgl1")
_INSTALL = f"{install_hint('window')}, or `make view`"


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add `view`."""
    command = subparsers.add_parser(
        "view",
        help="the review window: look, compare, probe",
        description="Open the window in which colours are judged: a scene, materials on a shape, a spectral image, or "
        "a session that was saved. Exit code 4 where no window can be opened.",
    )
    command.add_argument(
        "what",
        nargs="*",
        metavar="SCENE | MATERIAL... | IMAGE.exr [IMAGE.exr]",
        help="scene.toml, session.toml, ids or patterns of materials, or a spectral or XYZ OpenEXR and another one "
        "that it is compared with, such as the pictures of a review; default: a shipped scene",
    )
    command.add_argument("--last", action="store_true", help="go on where the window was closed the last time")
    add_display_option(command)
    add_catalogue_option(command)
    command.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Open it; 0 once it is closed."""
    from ..materials.catalogue.catalogue import Catalogue, default_catalogue
    from ..runtime.errors import UsageError
    from ..viewer.display.transform import DisplayTransform
    from ..viewer.picture import display_for
    from ..viewer.window.display_pass import display_of
    from ..viewer.window.session_loader import comparison_of, load, subject_of
    from ..viewer.window.state import SESSION_FILE, Session
    from ..viewer.window.workspace import Desk, begun

    if args.last and args.what:
        raise UsageError("--last: it says what to look at, name nothing else")
    folder = local_folder(args.catalogue or default_catalogue(), "the window")
    check_display_option(args.display)
    shell = window_module("main_loop")
    shell.check_screen()
    # For images none is made where there is none.
    of_images = bool(args.what) and all(Path(word).suffix.lower() == ".exr" for word in args.what)
    without = of_images and args.catalogue is None and not folder.exists()
    catalogue = Catalogue(folder) if without else catalogue_for(args.catalogue, 1)
    kept = _kept()
    found = SESSION_FILE.read(kept) if args.last else subject_of(args.what, catalogue)
    named = None if args.catalogue is None else str(args.catalogue)
    if isinstance(found, Session):
        session = found if named is None else replace(found, catalogue=named)
        loaded = load(session.subject, session.catalogue)
        path = None if args.last else Path(args.what[0])
    else:
        loaded, path = load(found, named), None
        session = begun(loaded, **comparison_of(args.what))
    if args.display is not None:
        session = replace(session, shown=replace(session.shown, config=None, display=args.display, view=None))
        # One that there is not is said before the window opens.
        display_of(session, DisplayTransform() if loaded.scene is None else display_for(loaded.scene))
    desk = Desk(loaded, session)
    desk.path = path
    shell.run(desk, keep=kept)
    return 0


def window_module(name: str):
    """Import a module of the window's shell, if its requirements are installed."""
    try:
        return import_module(f"..viewer.window.shell.{name}", __package__)
    except ImportError as reason:
        if "cannot open shared object file" in str(reason):
            hint = system_hint(_LIBRARIES)
            raise InputError("the window lacks a library of the system", found=str(reason), hint=hint) from reason
        if reason.name not in ("imgui_bundle", "glfw", "moderngl"):
            raise
        raise InputError(
            "the window is not installed", found=str(reason), expected="the extra `window`", hint=_INSTALL
        ) from reason


def _kept() -> Path:
    """Return the path at which the session is saved when the window is closed."""
    from platformdirs import user_state_path

    moved = os.environ.get("XDG_STATE_HOME")
    folder = Path(moved) / "metamer" if moved else user_state_path("metamer", appauthor=False)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as reason:
        hint = "set XDG_STATE_HOME to a folder that can be written"
        raise InputError("no place to keep sessions", file=folder, found=reason.strerror, hint=hint) from reason
    return folder / "last-session.toml"
