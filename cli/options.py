"""Options and arguments shared by subcommands, and the objects made from them."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..runtime.errors import InputError, UnknownNameError
from ..runtime.files import existing_file
from ..runtime.remote import is_remote, place
from .output import say

if TYPE_CHECKING:
    from ..materials.catalogue.catalogue import Catalogue
    from ..spectral.formats.import_options import ImportOptions
    from ..viewer.render.session import RenderSession


CATALOGUE_HELP = "catalogue folder or URL (default: $METAMER_CATALOGUE, or ./metamer-catalogue)"

# The end of a file's name, with "#ENTRY" or without: names of lamps end in none.
_FILE = re.compile(r"\.[A-Za-z]\w*(#.*)?$")


def comma_separated(text: str) -> tuple[str, ...]:
    """Split an option such as `--illuminants D65,A,FL11` into words."""
    words = tuple(word.strip() for word in text.split(",") if word.strip())
    if not words:
        raise argparse.ArgumentTypeError("names nothing")
    return words


def checked(text: str, check: Callable[[str], object]) -> str:
    """Return an option's word unchanged; converts an `InputError` of `check` to `ArgumentTypeError`."""
    try:
        check(text)
    except InputError as reason:
        raise argparse.ArgumentTypeError(str(reason)) from None
    return text


def illuminant_name(text: str) -> str:
    """Return the name of a known illuminant."""
    from ..spectral.illuminants import illuminant

    return checked(text, illuminant)


def parse_illuminants(text: str) -> tuple[str, ...]:
    """Return names of known illuminants."""
    return tuple(map(illuminant_name, comma_separated(text)))


def parse_lights(text: str) -> tuple[str, ...]:
    """Return names of lights: known illuminants, and files of measured lamps, with "#ENTRY" or without."""
    return tuple(map(light_name, comma_separated(text)))


def light_name(word: str) -> str:
    """Return the name of a known illuminant, or of an existing file of measured lamps."""
    file = word if Path(word).is_file() else word.rpartition("#")[0] or word
    if not Path(file).is_file():
        # Names of lamps end in no suffix.
        return checked(word, lambda name: existing_file(file)) if _FILE.search(file) else illuminant_name(word)
    return word


def add_lights_options(parser: argparse.ArgumentParser, what: str) -> None:
    """Add options for the lights and the observer."""
    parser.add_argument(
        "--illuminants",
        type=parse_illuminants,
        action=Added,
        default=("D65", "A", "FL11"),
        metavar="X,Y",
        help=f"{what} (default: D65,A,FL11)",
    )
    parser.add_argument(
        "--observer", type=parse_observer, default="1931_2", metavar="NAME", help="of the same (default: 1931_2)"
    )


def add_illuminant_option(
    parser: argparse.ArgumentParser, words: str = "in place of every light's own spectrum"
) -> None:
    """Add `--illuminant`, one light by its name or its file."""
    parser.add_argument(
        "--illuminant", type=light_name, metavar="NAME|FILE", help=f"{words}; a measured lamp as FILE or FILE#ENTRY"
    )


def parse_observer(text: str) -> str:
    """Return the short name of a known observer."""
    from ..spectral.observers import observer_name

    return observer_name(checked(text, observer_name))


class Added(argparse.Action):
    """Option with several values that accumulates distinct ones, in place of the default."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        """Called by argparse for each occurrence of the option."""
        had = getattr(namespace, self.dest, self.default)
        before = () if had is self.default else had
        setattr(namespace, self.dest, tuple(dict.fromkeys((*before, *values))))


def positive_count(text: str) -> int:
    """Return a whole number, at least 1."""
    if not (text.isascii() and text.isdecimal()) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"a whole number, at least 1, not {text}")
    return int(text)


def positive_delta_e(text: str) -> float:
    """Return a ΔE94 above 0."""
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0.0 < number < float("inf"):
        raise argparse.ArgumentTypeError(f"a ΔE94 above 0, not {text}")
    return number


def add_answer_options(command: argparse.ArgumentParser) -> None:
    """Add options for facts that files of readings leave open: `--as`, `--scale`, `--decimal`, `--colours-for`."""
    command.add_argument(
        "--as",
        dest="quantity",
        type=lambda words: words.strip().replace(" ", "-").replace("_", "-"),
        choices=("reflectance", "radiance-factor", "transmittance", "emission"),
        help="what files hold that do not say it",
    )
    command.add_argument("--scale", choices=("percent", "fraction"), help="what their numbers are that do not say it")
    command.add_argument(
        "--decimal", choices=("comma", "point"), help="the decimal mark of tables whose rows can be read in two ways"
    )
    command.add_argument(
        "--colours-for",
        type=_conditions,
        metavar="LIGHT/OBSERVER",
        help="what XYZ and CIELAB are for in files that do not say it, such as D50/1931_2",
    )


def answer_of(args: argparse.Namespace) -> ImportOptions:
    """Return the answer given by the options of `add_answer_options`."""
    from ..spectral.formats.import_options import ImportOptions

    quantity = args.quantity and args.quantity.replace("-", " ")
    return ImportOptions(quantity, args.scale, colours_for=args.colours_for, decimal=args.decimal)


def _conditions(text: str) -> tuple[str, str]:
    light, slash, eye = text.partition("/")
    if not (light and slash and eye):
        raise argparse.ArgumentTypeError(f"{text!r} is not an illuminant and an observer, such as D50/1931_2")
    return light, eye


def add_across_option(command: argparse.ArgumentParser) -> None:
    """Add `--across`, accepted differences between measurements."""
    command.add_argument(
        "--across",
        type=_crossings,
        action=Added,
        default=(),
        metavar="X,Y",
        help="compare readings although their geometry (with the specular component), or their condition (M0 to M3, "
        "filter, polarisation, backing), is not the same: geometry, condition",
    )


def _crossings(text: str) -> tuple[str, ...]:
    names = comma_separated(text)
    for name in names:
        if name not in ("geometry", "condition"):
            raise argparse.ArgumentTypeError(f"{name!r} is neither geometry nor condition")
    return names


def add_scheduler_option(command: argparse.ArgumentParser, does: str) -> None:
    """Add `--scheduler`; `does` states in one word what the workers do."""
    words = f"let the workers of this Dask scheduler {does} (extra: cluster)"
    command.add_argument("--scheduler", metavar="ADDRESS", help=words)


def add_renderer_option(command: argparse.ArgumentParser) -> None:
    """Add `--renderer`."""
    command.add_argument(
        "--renderer",
        choices=("auto", "gl", "software"),
        default="auto",
        help="default: GL, else software, and it says so",
    )


def renderer_for(choice: str) -> RenderSession:
    """Return the requested renderer; "auto" falls back to software and prints why."""
    from ..viewer.api import renderer_named

    renderer, reason = renderer_named(choice)
    if reason is not None:
        say(f"No OpenGL here, so the software path renders. {reason}")
    return renderer


def amounts(text: str, sign: str = "=") -> dict[str, float]:
    """Parse amounts by words of a wish; raises `ArgumentTypeError` for other text."""
    from ..materials.search.appearance_offset import WORDS

    found: dict[str, float] = {}
    for part in text.split(","):
        word, given, number = (piece.strip() for piece in part.partition(sign))
        if not (word and given and number):
            raise argparse.ArgumentTypeError(f"{part!r} is not WORD{sign}N, such as warmer{sign}10")
        try:
            amount = float(number)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{word}: a number, not {number}") from None
        if word not in WORDS:
            unknown = UnknownNameError("word for a wish", word, WORDS).at(expected=", ".join(WORDS))
            raise argparse.ArgumentTypeError(str(unknown))
        if word in found:
            raise argparse.ArgumentTypeError(f"{word} is said twice")
        found[word] = amount
    return found


def add_json_option(command: argparse.ArgumentParser, words: str = "every figure, for a program", **more: Any) -> None:
    """Add `--json`."""
    command.add_argument("--json", type=Path, metavar="FILE", help=f"{words}; - for standard output", **more)


def add_output_option(
    command: argparse.ArgumentParser,
    words: str,
    *,
    metavar: str = "FILE",
    required: bool = False,
    old: str = "",
    **more: Any,
) -> None:
    """Add `-o` or `--output`; an `old` name is accepted, too, and hidden."""
    group = command.add_mutually_exclusive_group(required=required)
    group.add_argument("-o", "--output", dest="out", type=Path, metavar=metavar, help=words, **more)
    if old:
        group.add_argument(old, dest="out", type=Path, default=argparse.SUPPRESS, help=argparse.SUPPRESS)


class _Given(argparse.Action):
    """Optional argument that keeps the value of the option of its name when omitted."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        """Called by argparse, also if the argument is omitted."""
        if values is not None:
            setattr(namespace, self.dest, values)


def add_catalogue_argument(verb: argparse.ArgumentParser) -> None:
    """Add `[CAT]`, the last argument of every verb that reads; or `--catalogue`, as in other commands."""
    group = verb.add_mutually_exclusive_group()
    group.add_argument("catalogue", nargs="?", type=place, action=_Given, metavar="CAT", help=CATALOGUE_HELP)
    group.add_argument("--catalogue", type=place, metavar="CAT", default=argparse.SUPPRESS, help="the same")


def open_catalogue(folder: Path | None) -> Catalogue:
    """Open the requested catalogue, or the default one."""
    from ..materials.catalogue.catalogue import Catalogue, default_catalogue

    return Catalogue.open(folder or default_catalogue())


def add_catalogue_option(command: argparse.ArgumentParser) -> None:
    """Add `--catalogue`."""
    command.add_argument(
        "--catalogue",
        type=place,
        metavar="CAT",
        help="default: $METAMER_CATALOGUE, or ./metamer-catalogue, made from the shipped materials where missing",
    )


def add_display_option(command: argparse.ArgumentParser) -> None:
    """Add `--display`."""
    command.add_argument(
        "--display",
        metavar="NAME",
        help="what pictures are encoded for, in place of the scene's: a display of its OpenColorIO configuration, "
        "icc:FILE for one with an ICC profile, icc:screen for the profile that the system has",
    )


def check_display_option(name: str | None) -> None:
    """Raise `InputError` for an unusable ICC profile in `--display`; other names are checked with their scene."""
    from ..calibration.display.icc_profile import PREFIX
    from ..viewer.display.transform import DisplayTransform

    if name is not None and name.startswith(PREFIX):
        DisplayTransform(name)


def catalogue_for(folder: Path | None, jobs: int) -> Catalogue:
    """Open the requested catalogue; a missing default one is first made from the shipped materials."""
    from ..materials.catalogue.catalogue import Catalogue, default_catalogue
    from ..materials.catalogue.shipped import shipped_sources
    from .progress.imports import import_shown

    if folder is None:
        folder = default_catalogue()
        if not is_remote(folder) and not folder.exists():
            from ..materials.intake.importing import import_sources
            from ..runtime.shutdown import saying

            print(f"No catalogue at {folder} yet: importing the shipped materials.", flush=True)
            with ExitStack() as stack:
                stack.enter_context(saying(lambda: "`metamer catalogue import` completes the catalogue."))
                shown = import_shown(stack, [shipped_sources()])
                hooks = {"looked_at": shown.looked_at, "begins": shown.begins, "doing": shown.doing}
                import_sources([shipped_sources()], folder, jobs=jobs, progress=shown.progress, **hooks)
    return Catalogue.open(folder)
