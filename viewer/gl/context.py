"""Creation of headless GL contexts."""

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

# Contexts created here; window toolkits make their own current.
_made: WeakSet[moderngl.Context] = WeakSet()


class NoGL(MetamerError):
    """Error for an unavailable OpenGL 4.10 context; the message lists the attempts and packages to install.

    `attempts` has a (back end, reason) pair for each.
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
    """Create a headless OpenGL context of at least version 4.10.

    EGL is tried first, since it needs neither display nor window, then the platform's default back end. The environment
    variable `METAMER_NO_GL=1` disables GL, so that callers use numpy.

    Raises
    ------
    NoGL : neither succeeds; the message names the system packages.
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
        except Exception as reason:  # loaders raise arbitrary exceptions, which all mean failure
            first_line = (str(reason).strip().splitlines() or [""])[0]
            attempts.append((label, first_line or type(reason).__name__))
    raise NoGL(tuple(attempts))


def make_current(context: moderngl.Context) -> None:
    """Make a context of `create_context` current; otherwise drawing would go to the newest one."""
    if context in _made:
        context.__enter__()


def release_context(context: moderngl.Context) -> None:
    """Release a context of `create_context` and all its objects."""
    _made.discard(context)
    context.release()


def describe(context: moderngl.Context) -> str:
    """Name version and device, such as 'OpenGL 4.5 llvmpipe (LLVM 19.1.7)'."""
    version = context.version_code
    return f"OpenGL {version // 100}.{version % 100 // 10} {context.info['GL_RENDERER']}"
