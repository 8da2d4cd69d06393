"""Distribution name of Metamer, which differs from its import name."""

from __future__ import annotations

import shutil
from collections.abc import Sequence

#: On the package index, "metamer" is another project.
DISTRIBUTION = "metamer-colour"


def installed_version() -> str:
    """Return the version that is installed, as "1.2.0"."""
    from importlib.metadata import version

    return version(DISTRIBUTION)


def system_hint(packages: Sequence[str]) -> str:
    """Describe how to install system libraries: by apt-get if available, else by their Debian names.

    >>> "libegl1" in system_hint(["libegl1"])
    True
    """
    if shutil.which("apt-get"):
        return "apt-get install " + " ".join(packages)
    return f"install what Debian calls {', '.join(packages)} by the packages of your system"


def install_hint(extra: str) -> str:
    """Say how an optional extra is installed."""
    return f"pip install '{DISTRIBUTION}[{extra}]'"
