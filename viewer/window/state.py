"""State of the window as one value: a `Session`."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Literal, get_args

from ...calibration.report.rating import Rating
from ...runtime.errors import InputError
from ...runtime.toml_records import RecordFile
from ...spectral.adaptation import CONE_FROM_XYZ
from ...spectral.image_difference import ImageFormula
from ...spectral.observers import OBSERVERS
from .checks import check_known, check_positive, check_text, check_within
from .light_choice import LightChoice
from .places import Pin, Region
from .viewpoint import Viewpoint, orbited

Kind = Literal["scene", "materials", "image"]
#: Comparison mode of the two sides; "difference" is the ΔE map.
Mode = Literal["A", "B", "wipe", "side by side", "checkerboard", "difference"]
#: Origin of a side's image: render forms, the reference, or a file (a baseline or an image).
Made = Literal["fast", "reference", "file"]
Interface = Literal["dark", "light"]
MODES: tuple[Mode, ...] = get_args(Mode)
FORMULAS: tuple[ImageFormula, ...] = get_args(ImageFormula)
#: Least size of the checkerboard's cells, in image heights.
LEAST_CELL = 0.005
# Metadata of transient fields, which are neither saved nor undone: pointer and held key.
_PASSING = {"passing": True}


@dataclass(frozen=True)
class Subject:
    """Subject of a session: scene, materials or image.

    kind : a scene, materials on a shape, or an image. path : file of the scene or image; for materials, of their scene,
        None for the shipped one. materials : ids offered for the shown part; () for the whole catalogue.
    shape : generated shape or mesh file that replaces the shown part's.
    own_light, luminance : settings missing in an image's file: the lamp in which it was recorded, and cd/m^2 of its
        white.
    """

    kind: Kind = "scene"
    path: str | None = None
    materials: tuple[str, ...] = ()
    shape: str | None = None
    own_light: str | None = None
    luminance: float | None = None

    def __post_init__(self) -> None:
        check_known(self.kind, get_args(Kind), "kind", "kind of subject")
        if self.luminance is not None:
            check_positive(self.luminance, "luminance", "cd/m^2")
        for name in ("path", "shape", "own_light"):
            if (value := getattr(self, name)) is not None:
                check_text(value, name)
        for one in self.materials:
            check_text(one, "materials")
        if self.kind == "image" and self.path is None:
            raise InputError("no image", field="path", expected="the file of a spectral or XYZ OpenEXR")


@dataclass(frozen=True)
class Worn:
    """Material that replaces a part's own."""

    part: str
    material: str

    def __post_init__(self) -> None:
        check_text(self.part, "part")
        check_text(self.material, "material")


@dataclass(frozen=True)
class Edit:
    """Changed value of a parameter of a material's formula (`materials.search.sliders`)."""

    material: str
    parameter: str
    value: float

    def __post_init__(self) -> None:
        check_text(self.material, "material")
        check_text(self.parameter, "parameter")
        check_within(self.value, -1e12, 1e12, "value")


@dataclass(frozen=True)
class Adaptation:
    """Chromatic adaptation from XYZ under the light's white to the display's, by `method` and degree.

    degree : 1 is full adaptation, 0 none; between, D of CIE 159:2004, chosen by the user or by `degree_of_adaptation`.
    """

    method: str = "Bradford"
    degree: float = 1.0

    def __post_init__(self) -> None:
        check_known(self.method, CONE_FROM_XYZ, "method", "chromatic adaptation")
        check_within(self.degree, 0.0, 1.0, "degree")

    @property
    def words(self) -> str:
        """Description of the adaptation, for the chain."""
        if self.degree == 0.0:
            return "no adaptation"
        return f"{self.method}{'' if self.degree == 1.0 else f', incomplete (D = {self.degree:.2f})'}"


@dataclass(frozen=True)
class Other:
    """Side B: overrides of side A.

    material : on the shown part. light, observer : its own. catalogue : folder of another version of the materials.
    made : origin of its image. file : of an image or baseline, if `made` is "file".
    """

    material: str | None = None
    light: LightChoice | None = None
    observer: str | None = None
    catalogue: str | None = None
    made: Made = "fast"
    file: str | None = None

    def __post_init__(self) -> None:
        for name in ("material", "catalogue", "file"):
            if (value := getattr(self, name)) is not None:
                check_text(value, name)
        if self.observer is not None:
            check_known(self.observer, OBSERVERS, "observer", "observer")
        check_known(self.made, get_args(Made), "made", "way to make a picture")
        if (self.made == "file") != (self.file is not None):
            expected = "a picture's file" if self.file is None else 'made = "file" beside it'
            raise InputError("a file and `made` do not fit", field="file", found=self.file, expected=expected)


@dataclass(frozen=True)
class Compare:
    """Comparison mode of A and B.

    position : of the wipe, from the left. cell : of the checkerboard, in image heights. formula : of the ΔE map, with A
    as the reference. scale : ΔE at the end of its colours. tolerance : ΔE of the contour, above which pixels are
    counted. contour : whether it is drawn.
    """

    mode: Mode = "A"
    position: float = 0.5
    cell: float = 0.1
    formula: ImageFormula = "CIE 1994"
    scale: float = 5.0
    tolerance: float = 1.0
    contour: bool = True

    def __post_init__(self) -> None:
        check_known(self.mode, MODES, "mode", "way to compare")
        check_within(self.position, 0.0, 1.0, "position")
        check_within(self.cell, LEAST_CELL, 1.0, "cell")
        check_known(self.formula, FORMULAS, "formula", "colour difference")
        check_within(self.scale, 0.01, 100.0, "scale", "ΔE")
        check_within(self.tolerance, 0.01, 100.0, "tolerance", "ΔE")


@dataclass(frozen=True)
class DisplaySettings:
    """Display settings.

    config, display, view : of OpenColorIO; None is the scene's, or the default. gamut_warning : mark colours that the
    display cannot show. proof : display of the configuration, or `icc:FILE`, for soft proofing.
    """

    config: str | None = None
    display: str | None = None
    view: str | None = None
    gamut_warning: bool = False
    proof: str | None = None

    def __post_init__(self) -> None:
        for name in ("config", "display", "view", "proof"):
            if (value := getattr(self, name)) is not None:
                check_text(value, name)


@dataclass(frozen=True)
class Session:
    """State of a window.

    Parameters
    ----------
    subject, catalogue : shown subject, and folder of materials; None is the default one.
    view : viewpoint. turntable_deg_s : speed of automatic rotation; 0 for none. samples : along a side of a pixel.
    part : shown part, for materials; None is the scene's reviewed part. worn : materials on parts. edits : of
        materials.
    light, observer : of side A. other : overrides of side B. compare : comparison mode.
    adaptation, exposure : the latter in stops. surround : L* around the image. shown : display settings.
    bounces : whether indirect light is shown. influence : part of which only the light reflected onto others is shown;
        None shows all light.
    pins, regions : probed places. ratings : the reviewer's protocol.
    interface : the grey of panels.
    cursor : pointer position in shares of the image's width and height. flicked : True while the flick key is held.
        Both are transient: neither saved nor undone.

    Raises
    ------
    InputError, UnknownNameError : a value out of range, by field; duplicate names of pins or regions; a part or
        parameter changed twice.
    """

    subject: Subject = field(default_factory=Subject)
    catalogue: str | None = None
    view: Viewpoint = field(default_factory=Viewpoint)
    turntable_deg_s: float = 0.0
    samples: int = 3
    part: str | None = None
    worn: tuple[Worn, ...] = ()
    edits: tuple[Edit, ...] = ()
    light: LightChoice = field(default_factory=LightChoice)
    observer: str = "1931_2"
    other: Other = field(default_factory=Other)
    compare: Compare = field(default_factory=Compare)
    adaptation: Adaptation = field(default_factory=Adaptation)
    exposure: float = 0.0
    surround: float = 50.0
    shown: DisplaySettings = field(default_factory=DisplaySettings)
    bounces: bool = False
    influence: str | None = None
    pins: tuple[Pin, ...] = ()
    regions: tuple[Region, ...] = ()
    ratings: tuple[Rating, ...] = ()
    interface: Interface = "dark"
    cursor: tuple[float, float] | None = field(default=None, metadata=_PASSING)
    flicked: bool = field(default=False, metadata=_PASSING)

    def __post_init__(self) -> None:
        for name in ("catalogue", "part", "influence"):
            if (value := getattr(self, name)) is not None:
                check_text(value, name)
        check_within(self.turntable_deg_s, -360.0, 360.0, "turntable_deg_s", "degrees a second")
        check_within(self.samples, 1, 64, "samples")
        check_known(self.observer, OBSERVERS, "observer", "observer")
        check_within(self.exposure, -10.0, 10.0, "exposure", "stops")
        check_within(self.surround, 20.0, 90.0, "surround", "L*")
        check_known(self.interface, get_args(Interface), "interface", "interface")
        _check_once([one.part for one in self.worn], "worn", "two materials on a part")
        _check_once([f"{one.material}: {one.parameter}" for one in self.edits], "edits", "a parameter twice")
        for name in ("pins", "regions"):
            _check_once([one.name for one in getattr(self, name)], name, "two of one name")
        _check_once([" under ".join(one.key) for one in self.ratings], "ratings", "rated twice")
        if self.cursor is not None:
            for share in self.cursor:
                check_within(share, 0.0, 1.0, "cursor")

    @property
    def settled(self) -> Session:
        """Return the session without transient values."""
        return replace(self, **{name: getattr(_STILL, name) for name in PASSING})

    def with_passing_of(self, now: Session) -> Session:
        """Return this session with the transient values of another, which undo does not affect."""
        return replace(self, **{name: getattr(now, name) for name in PASSING})

    @property
    def seen(self) -> Mode:
        """Return the current comparison mode: a held flick shows the other side for A and B, and B for all other
        modes.
        """
        if not self.flicked:
            return self.compare.mode
        return "A" if self.compare.mode == "B" else "B"

    def material_of(self, part: str) -> str | None:
        """Return the material id chosen for a part of side A; None is the scene's own."""
        return next((one.material for one in self.worn if one.part == part), None)

    def wearing(self, part: str, material: str) -> Session:
        """Put a material on a part of side A."""
        rest = tuple(one for one in self.worn if one.part != part)
        return replace(self, worn=(*rest, Worn(part, material)))

    def edited(self, material: str, parameter: str, value: float | None) -> Session:
        """Set a parameter of a material; None resets it."""
        rest = tuple(one for one in self.edits if (one.material, one.parameter) != (material, parameter))
        return replace(self, edits=rest if value is None else (*rest, Edit(material, parameter, float(value))))

    def rated(self, rating: Rating) -> Session:
        """Add a rating, replacing an earlier one of the same."""
        rest = tuple(one for one in self.ratings if one.key != rating.key)
        return replace(self, ratings=(*rest, rating))


def _check_once(names: list[str], where: str, problem: str) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(problem, field=where, found=twice[0], expected="each once")


PASSING = tuple(one.name for one in fields(Session) if one.metadata.get("passing"))
_STILL = Session()


#: Largest time step, seconds, to avoid jumps after a pause.
LONGEST_S = 0.25


def turned_on(session: Session, seconds: float) -> Session:
    """Advance the turntable of a session by a time step."""
    if not session.turntable_deg_s or session.subject.kind == "image":
        return session
    degrees = session.turntable_deg_s * min(seconds, LONGEST_S)
    return replace(session, view=orbited(session.view, degrees))


#: Session files: TOML, written atomically, read with errors by key.
SESSION_FILE = RecordFile(
    Session, "metamer_session", 1, "session of the window", "the window: Ctrl+S, or `save` among its commands"
)
