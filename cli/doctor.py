"""`metamer doctor`: what this machine offers, and what to install for the rest."""

from __future__ import annotations

import argparse
import os
import platform
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version

from ..runtime.errors import MetamerError

_LIBRARIES = ("numpy", "scipy", "colour-science", "moderngl", "opencolorio", "OpenEXR", "trimesh", "embreex", "h5py")


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add `doctor`."""
    command = subparsers.add_parser(
        "doctor",
        help="what this machine offers, and what to install",
        description="Say which renderer, display transform, rays and libraries there are here, and what to install for "
        "the rest, and what is kept of scenes from run to run.",
    )
    command.add_argument("--brief", action="store_true", help="one line for each part")
    command.add_argument(
        "--clear-cache", action="store_true", help="remove what is kept of scenes from run to run; it is computed again"
    )
    command.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Look and print; 0, or the exit code of the last error met."""
    checks: dict[str, Callable[[], str]] = {
        "renderer": _renderer,
        "display": _display,
        "reference": _reference,
        "cache": lambda: _cache(args.clear_cache),
    }
    code = 0
    for label, check in checks.items():
        try:
            found = check()
        except MetamerError as reason:
            found, code = str(reason), reason.exit_code
        print(f"{label:>10}: {found}")
    if not args.brief:
        print(f"{'python':>10}: {platform.python_version()} on {platform.platform()}, {os.cpu_count()} cores")
        for library in _LIBRARIES:
            print(f"{library:>14} {_version(library)}")
    return code


def _renderer() -> str:
    from ..viewer.gl.context import NoGL, create_context, describe, release_context

    try:
        context = create_context()
    except NoGL as reason:
        return f"software (numpy). {reason}"
    name = describe(context)
    release_context(context)
    return name


def _display() -> str:
    import PyOpenColorIO as ocio

    from ..viewer.display.transform import DisplayTransform

    transform = DisplayTransform()
    return f"OpenColorIO {ocio.__version__}, {transform.config_name}, {transform.display}, {transform.view}"


def _reference() -> str:
    from ..lighting.mesh.ray_index import has_embree, rays_words

    if has_embree():
        return f"{rays_words()} (embreex {_version('embreex')})"
    return (
        f"{rays_words()}, some hundred times slower than Embree's. no Embree: pip install embreex "
        "(some systems on ARM processors have no package of it)"
    )


def _cache(clear: bool) -> str:
    from ..lighting.visibility.cache_limits import cache_words, pruned, transfer_folder, visibility_folder

    folders = (visibility_folder(), transfer_folder())
    if clear:
        for folder in folders:
            pruned(folder, 0)
    return "\n            ".join(cache_words(folder) for folder in folders)


def _version(library: str) -> str:
    try:
        return version(library)
    except PackageNotFoundError:
        return f"missing: pip install {library}"
