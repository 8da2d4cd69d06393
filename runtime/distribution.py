"""Name that Metamer is installed under, which is not the name that it is imported by."""

#: On the package index, "metamer" is another project.
DISTRIBUTION = "metamer-colour"


def installed_version() -> str:
    """Return the version that is installed, as "1.2.0"."""
    from importlib.metadata import version

    return version(DISTRIBUTION)


def install_hint(extra: str) -> str:
    """Say how an optional extra is installed."""
    return f"pip install '{DISTRIBUTION}[{extra}]'"
