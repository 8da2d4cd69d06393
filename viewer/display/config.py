"""Custom displays in an OpenColorIO configuration: the pinned one with a further display.

A display is characterised, or has an ICC profile. Readings with spectra give one more display for each further
observer, with the same tables behind a matrix; these are not listed in menus but selected by name (`name_for`). Each
has:

A colour space with a transform from XYZ-D65: a matrix, a mirrored power of 1/3, a range, a curve per channel, and a
cube. Its inverse is a separate table, since the cube maps colours outside the gamut to the nearest inside and is not
invertible. Two views: the colorimetric one, as for other displays of the configuration, and the same with the black
point moved to the display's.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ...calibration.display.aim import Aim, Black
from ...calibration.display.cube import Cube
from ...calibration.display.icc_profile import DisplayProfile
from ...calibration.display.model import FLOOR, DisplayModel, roots
from ...calibration.display.observer_aims import ObserverAim
from ...runtime.errors import InputError
from ...runtime.files import made_folder, written_whole

# Pinned by its full name, since "default" and "latest" change between releases of OpenColorIO.
PINNED_CONFIG = "ocio://cg-config-v2.2.0_aces-v1.3_ocio-v2.4"
#: The colorimetric view.
DEFAULT_VIEW = "Un-tone-mapped"
#: The second view.
COMPENSATED = "Black-point compensated"
# Nodes along an edge of the cube from codes to colours, and the power that concentrates them towards black: ΔE94 0.02
# on average and at most 0.26 from the model, for six synthetic displays.
_SHOWN_SIZE, _TOWARDS_BLACK = 33, 1.6
_FORMAT = "Academy/ASC Common LUT Format"
_CONFIG, _TABLES = "config.ocio", "luts"
# Start of the description of a display's colour space, followed by the observer that it is aimed for.
_DESCRIBED = re.compile(r"Characterised by Metamer, [\w-]+, observer (\w+);")
# Fixed modification time of zip members, so that equal displays give equal bytes.
_NO_TIME = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class Written:
    """Files of a configuration: `config.ocio` in a folder, and the same in a single file."""

    config: Path
    archive: Path
    display: str


def name_for(display: str, observer: str) -> str:
    """Return the name of a display aimed for another observer (short name) than it was characterised for."""
    return f"{display} ({observer})"


def description(model: str, observer: str, white: str) -> str:
    """Describe the colour space of a display: its model, who it is aimed for, and its white."""
    return f"Characterised by Metamer, {model}, observer {observer}; white {white}"


def described_observer(words: str) -> str:
    """Return the observer named in the description of a colour space; by default that of OpenColorIO's XYZ."""
    found = _DESCRIBED.match(words)
    return found[1] if found else "1931_2"


def display_transform(cube: Cube, aim: Aim) -> Any:
    """Return OCIO transforms from XYZ-D65 to codes, in memory."""
    import PyOpenColorIO as ocio

    matrix, offset = np.eye(4), np.zeros(4)
    matrix[:3, :3] = cube.light_from_xyz @ aim.adapted
    offset[:3] = -cube.light_from_xyz @ cube.black_xyz
    low, high = cube.domain
    third = ocio.ExponentTransform([1.0 / 3.0] * 3 + [1.0], negativeStyle=ocio.NEGATIVE_MIRROR)
    curves = ocio.Lut1DTransform(len(cube.curves), False)
    curves.setData(np.ascontiguousarray(cube.curves, dtype=np.float32))
    nodes = ocio.Lut3DTransform(len(cube.nodes))
    # OCIO has the same order of the cube: red slowest, blue fastest.
    nodes.setData(np.ascontiguousarray(cube.nodes, dtype=np.float32))
    nodes.setInterpolation(ocio.INTERP_TETRAHEDRAL)
    return ocio.GroupTransform(
        [
            ocio.MatrixTransform(matrix.ravel().tolist(), offset.tolist()),
            third,
            ocio.RangeTransform(low, high, 0.0, 1.0),
            curves,
            nodes,
        ]
    )


def shown_transform(model: DisplayModel, aim: Aim) -> Any:
    """Return OCIO transforms from codes to the displayed XYZ-D65, in memory."""
    import PyOpenColorIO as ocio

    levels = np.linspace(0.0, 1.0, _SHOWN_SIZE) ** _TOWARDS_BLACK
    codes = np.stack(np.meshgrid(levels, levels, levels, indexing="ij"), axis=-1)
    nodes = ocio.Lut3DTransform(_SHOWN_SIZE)
    nodes.setData(np.ascontiguousarray(roots(model.xyz(codes), model.white_xyz), dtype=np.float32))
    nodes.setInterpolation(ocio.INTERP_TETRAHEDRAL)
    back, matrix, offset = np.linalg.inv(aim.adapted), np.eye(4), np.zeros(4)
    matrix[:3, :3] = back @ np.diag(model.white_xyz)
    offset[:3] = -back @ model.white_xyz * FLOOR
    return ocio.GroupTransform(
        [
            ocio.ExponentTransform([1.0 / _TOWARDS_BLACK] * 3 + [1.0], negativeStyle=ocio.NEGATIVE_CLAMP),
            nodes,
            ocio.ExponentTransform([3.0] * 3 + [1.0], negativeStyle=ocio.NEGATIVE_MIRROR),
            ocio.MatrixTransform(matrix.ravel().tolist(), offset.tolist()),
        ]
    )


def make_config(
    name: str,
    transform: Any,
    shown: Any,
    aim: Aim,
    black: Black = "absolute",
    describing: str = "",
    others: Sequence[tuple[ObserverAim, str]] = (),
) -> Any:
    """Return the pinned configuration with this display as the first.

    name : of display and colour space. transform, shown : from XYZ-D65 to codes and from codes to XYZ-D65, in memory or
    as files. black : determines the first view. others : aims for other observers, each with its description.

    Raises
    ------
    InputError : a name of a display or colour space of the pinned configuration, or an empty one.
    """
    import PyOpenColorIO as ocio

    config = ocio.Config.CreateFromFile(PINNED_CONFIG)
    if '"' in name or not name.isprintable():
        # Lists of displays have quoted names.
        raise InputError(
            "a name that a configuration cannot hold",
            field="display",
            found=repr(name),
            expected="a name without quotes, in one line",
            hint="--name",
        )
    taken = [*config.getDisplays(), *config.getColorSpaceNames()]
    if not name.strip() or name.casefold() in (one.casefold() for one in taken):
        raise InputError(
            "a name that the configuration has already" if name.strip() else "a display without a name",
            field="display",
            found=repr(name),
            expected="a name of its own, such as the maker's and a number",
            hint="--name",
        )
    first = (COMPENSATED, DEFAULT_VIEW) if black == "bpc" else (DEFAULT_VIEW, COMPENSATED)
    _add_display(config, name, describing, (transform, shown), aim, COMPENSATED, first)
    displays = list(config.getDisplays())
    for one, words in others:
        front = _affine(one.front)
        back = _affine(one.front)
        back.setDirection(ocio.TRANSFORM_DIR_INVERSE)
        there_and_back = ocio.GroupTransform([front, transform]), ocio.GroupTransform([shown, back])
        compensated = f"{COMPENSATED} ({one.observer})"
        _add_display(config, name_for(name, one.observer), words, there_and_back, one.aim, compensated, first)
    # Quoted, since names may contain commas.
    config.setActiveDisplays(", ".join(f'"{one}"' for one in [name, *(each for each in displays if each != name)]))
    # Active views, if any, determine the default view of a display.
    if views := list(config.getActiveViews()):
        ahead = [COMPENSATED, *views] if black == "bpc" else [*views, COMPENSATED]
        config.setActiveViews(", ".join(f'"{one}"' for one in dict.fromkeys(ahead)))
    return config


def _add_display(
    config: Any,
    name: str,
    describing: str,
    there_and_back: tuple[Any, Any],
    aim: Aim,
    compensated: str,
    views: Sequence[str],
) -> None:
    """Add a display with both views. there_and_back : from XYZ-D65 to codes, and from codes to XYZ-D65. compensated :
    name of the transform of its view.
    """
    import PyOpenColorIO as ocio

    to, back = there_and_back
    config.addColorSpace(_display_space(name, describing, fromReference=to, toReference=back))
    shared = config.getViewTransform(DEFAULT_VIEW)
    to_display = shared.getTransform(ocio.VIEWTRANSFORM_DIR_FROM_REFERENCE)
    config.addViewTransform(
        ocio.ViewTransform(
            ocio.REFERENCE_SPACE_SCENE,
            name=compensated,
            description=f"Colorimetric, black moved to that of {name}",
            fromReference=ocio.GroupTransform([to_display, _affine(np.column_stack(aim.compensation()))]),
        )
    )
    transforms = {DEFAULT_VIEW: DEFAULT_VIEW, COMPENSATED: compensated}
    for view in views:
        config.addDisplayView(name, view, viewTransform=transforms[view], displayColorSpaceName=name)


def _affine(matrix: Float[np.ndarray, "3 4"]) -> Any:
    """Return OCIO's transform by a matrix and an offset."""
    import PyOpenColorIO as ocio

    whole = np.eye(4)
    whole[:3, :3] = matrix[:, :3]
    return ocio.MatrixTransform(whole.ravel().tolist(), [*matrix[:, 3].tolist(), 0.0])


@lru_cache(maxsize=8)
def profile_config(profile: DisplayProfile) -> tuple[Any, str]:
    """Return the pinned configuration with the display of an ICC profile, in the colorimetric view, and its name
    there.
    """
    import PyOpenColorIO as ocio

    config, name = ocio.Config.CreateFromFile(PINNED_CONFIG), f"ICC: {profile.name}"
    config.addColorSpace(
        _display_space(name, str(profile.path), fromReference=profile.from_xyz_d65, toReference=profile.to_xyz_d65)
    )
    config.addDisplayView(name, DEFAULT_VIEW, viewTransform=DEFAULT_VIEW, displayColorSpaceName=name)
    config.setActiveDisplays(f'"{name}"')
    return config, name


def _display_space(name: str, describing: str, **transforms: Any) -> Any:
    import PyOpenColorIO as ocio

    return ocio.ColorSpace(
        ocio.REFERENCE_SPACE_DISPLAY,
        name=name,
        family="Display",
        encoding="sdr-video",
        description=describing,
        **transforms,
    )


def write_config(
    folder: str | Path,
    name: str,
    model: DisplayModel,
    cube: Cube,
    aim: Aim,
    black: Black = "absolute",
    seen_by: str = "1931_2",
    others: Sequence[ObserverAim] = (),
) -> Written:
    """Write `config.ocio` with its tables into a folder, and the same as one `.ocioz`; each atomically.

    seen_by : observer of `aim`. others : aims for further observers.

    Raises
    ------
    InputError, NoRoomError : a name in use; a folder that is not writable, or a full disk.
    """
    import PyOpenColorIO as ocio

    folder = made_folder(folder)
    made_folder(folder / _TABLES)
    stem = file_stem(name)
    # Without a configuration OpenColorIO would warn that the environment has none.
    to, back = f"{stem}.clf", f"{stem}.shown.clf"
    transforms = {to: display_transform(cube, aim), back: shown_transform(model, aim)}
    tables = {file: one.write(_FORMAT, ocio.Config.CreateRaw()) for file, one in transforms.items()}
    describing = description(model.name, seen_by, aim.words)
    beside = [(one, description(model.name, one.observer, one.words)) for one in others]
    config = make_config(name, ocio.FileTransform(to), ocio.FileTransform(back), aim, black, describing, beside)
    config.setSearchPath(_TABLES)
    text = config.serialize()
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for member, content in ((_CONFIG, text), *((f"{_TABLES}/{file}", table) for file, table in tables.items())):
            archive.writestr(zipfile.ZipInfo(member, _NO_TIME), content, zipfile.ZIP_DEFLATED)
    written = Written(folder / _CONFIG, folder / f"{stem}.ocioz", name)
    # The configuration comes last, so that it never exists without its tables.
    contents = (
        *((folder / _TABLES / file, table.encode("utf-8")) for file, table in tables.items()),
        (written.archive, packed.getvalue()),
        (written.config, text.encode("utf-8")),
    )
    for path, content in contents:
        with written_whole(path) as unfinished:
            unfinished.write_bytes(content)
    return written


def file_stem(name: str) -> str:
    """Convert a display's name to a file name.

    >>> file_stem("EIZO CG279X (desk 4)")
    'EIZO_CG279X_desk_4'
    """
    words = "".join(letter if letter.isalnum() or letter in "-." else " " for letter in name).split()
    return "_".join(words).strip(".") or "display"
