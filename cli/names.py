"""`metamer names`: the names known to scenes and options."""

from __future__ import annotations

import argparse
from collections.abc import Callable

from ..calibration.report.text_tables import columns


def add_parser(subparsers: argparse._SubParsersAction) -> None:
    """Add `names`."""
    command = subparsers.add_parser(
        "names",
        help="the names of illuminants, observers, ... that scenes and options know",
        description="List the names that scenes and options know. Materials: metamer catalogue list.",
    )
    command.add_argument(
        "what", nargs="?", choices=tuple(KINDS), metavar="WHAT", help=f"{', '.join(KINDS)}; default: all"
    )
    command.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """List; 0."""
    for what in [args.what] if args.what else KINDS:
        title, listed = KINDS[what]
        print(f"{'' if args.what or what == next(iter(KINDS)) else chr(10)}{title}\n")
        print(listed())
    return 0


def _illuminants() -> str:
    from ..spectral.illuminants import BOOTH_NAMES, HORIZON, booth_words, illuminant_names

    booths = "; ".join(booth_words(name) for name in (*BOOTH_NAMES, HORIZON))
    return f"{_lights(illuminant_names())}\n\nNames on booths: {booths}."


def _light_sources() -> str:
    from ..spectral.illuminants import light_source_names

    return _lights(light_source_names())


def _lights(names: tuple[str, ...]) -> str:
    """List each light with its chromaticity for the CIE 1931 observer, and the range and step of its table."""
    from ..spectral.illuminants import illuminant
    from ..spectral.observers import observer

    seen, rows = observer("1931_2"), []
    for name in names:
        light = illuminant(name)
        x, y = (seen.white(light) / seen.white(light).sum())[:2]
        low, next_, *_, high = light.wavelengths_nm
        rows.append((name, f"{x:.4f}", f"{y:.4f}", f"{low:g} to {high:g} nm by {next_ - low:g}"))
    return columns(("name", "x", "y", "tabulated"), rows)


def _observers() -> str:
    from ..spectral.observers import OBSERVERS

    return columns(("name", "in full"), list(OBSERVERS.items()), left=2)


def _adaptations() -> str:
    from ..spectral.adaptation import CONE_FROM_XYZ

    return "\n".join(CONE_FROM_XYZ)


def _shapes() -> str:
    from ..lighting.scene_file.keys import PART, SHAPES

    rows = [(shape, ", ".join(keys)) for shape, keys in SHAPES.items()]
    return columns(
        ("name", f"its keys beside {', '.join(key for key in PART if key not in _NOT_OF_SHAPES)}"), rows, left=2
    )


# Keys of a part that only meshes and rows of patches have.
_NOT_OF_SHAPES = ("shape", "mesh", "mesh_part", "crease_deg", "materials")

#: Kinds of names that can be listed: a title, and the function that makes the list.
KINDS: dict[str, tuple[str, Callable[[], str]]] = {
    "illuminants": (
        "Illuminants of the CIE and ISO (spectrum, --illuminants; F1 is FL1, ..., F12 is FL12)",
        _illuminants,
    ),
    "light-sources": ("Measured light sources (spectrum, --illuminants)", _light_sources),
    "observers": ("Observers (observer of a scene)", _observers),
    "adaptations": ("Chromatic adaptation (adaptation of a scene)", _adaptations),
    "shapes": ("Generated shapes (shape of a part)", _shapes),
}
