"""The GL context: made here and nowhere else."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any
from weakref import WeakSet

from ...runtime.distribution import system_hint
from ...runtime.errors import MetamerError

if TYPE_CHECKING:
    import moderngl

# 4.10 core is the newest profile that every desktop platform offers.
REQUIRED_VERSION = 410
DISABLE_VARIABLE = "METAMER_NO_GL"
SYSTEM_PACKAGES = ("libegl1", "libgl1-mesa-dri")

# Contexts that were made here; whatever hosts a window makes its own ones current.
_made: WeakSet[moderngl.Context] = WeakSet()


class NoGL(MetamerError):
    """No OpenGL 4.10 context can be had; the message says what was tried and what to install.

    `attempts` holds a (back end, reason) pair for every way that was tried.
    """

    def __init__(self, attempts: tuple[tuple[str, str], ...], hint: str | None = None) -> None:
        self.attempts = attempts
        if hint is None:
            hint = f"{system_hint(SYSTEM_PACKAGES)}   (a software driver is enough, no display is needed)"
        tried = "\n".join(f"  {backend}: {reason}" for backend, reason in attempts)
        super().__init__(
            f"no OpenGL {REQUIRED_VERSION // 100}.{REQUIRED_VERSION % 100} context could be made\n{tried}\n"
            f"  try: {hint}"
        )


def create_context() -> moderngl.Context:
    """Return a new headless OpenGL context of at least version 4.10.

    EGL is tried first, because it needs neither a display nor a window, then the platform's default back end.
    The environment variable `METAMER_NO_GL=1` refuses GL, so that callers take the software path.

    Raises
    ------
    NoGL : neither back end gives a context; the message names the system packages.
    """
    if os.environ.get(DISABLE_VARIABLE, "0") not in ("", "0"):
        raise NoGL((("environment", f"{DISABLE_VARIABLE} is set, which asks for the software path"),))
    try:
        import moderngl
    except ImportError as reason:
        hint = "pip install moderngl   (some systems on ARM processors have no package of it: it is compiled there)"
        raise NoGL((("moderngl", str(reason)),), hint) from reason
    attempts: list[tuple[str, str]] = []
    ways: tuple[tuple[str, dict[str, Any]], ...] = (("EGL", {"backend": "egl"}), ("default back end", {}))
    for label, options in ways:
        try:
            context = moderngl.create_context(standalone=True, require=REQUIRED_VERSION, **options)
            _made.add(context)
            return context
        except Exception as reason:  # a loader raises whatever it likes: all of it means "not this way"
            first_line = (str(reason).strip().splitlines() or [""])[0]
            attempts.append((label, first_line or type(reason).__name__))
    raise NoGL(tuple(attempts))


def make_current(context: moderngl.Context) -> None:
    """Make a context of `create_context` current: what is drawn goes to the newest one otherwise, and is lost."""
    if context in _made:
        context.__enter__()


def release_context(context: moderngl.Context) -> None:
    """Release a context of `create_context`, with everything that was made in it."""
    _made.discard(context)
    context.release()


def describe(context: moderngl.Context) -> str:
    """Return one line that names version and device, such as 'OpenGL 4.5 llvmpipe (LLVM 19.1.7)'."""
    version = context.version_code
    return f"OpenGL {version // 100}.{version % 100 // 10} {context.info['GL_RENDERER']}"
