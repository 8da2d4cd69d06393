"""Name that Metamer is installed under, which is not the name that it is imported by."""

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
    """Say how libraries of the system are installed: by apt-get where there is one, else what Debian calls them.

    >>> "libegl1" in system_hint(["libegl1"])
    True
    """
    if shutil.which("apt-get"):
        return "apt-get install " + " ".join(packages)
    return f"install what Debian calls {', '.join(packages)} by the packages of your system"


def install_hint(extra: str) -> str:
    """Say how an optional extra is installed."""
    return f"pip install '{DISTRIBUTION}[{extra}]'"
