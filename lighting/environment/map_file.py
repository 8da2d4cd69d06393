"""Reader of environment maps: OpenEXR (RGB, XYZ, luminance or spectral) and Radiance images, twice as wide as high."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...runtime.memory import check_room, gigabytes
from ...spectral.formats.exr import MAGIC, MOST_SAMPLES, check_size, read_picture
from ...spectral.formats.spectral_exr import LENGTH, wavelength_of
from ...spectral.upsampling import xyz_from_rgb
from ...spectral.wavelengths import validated_wavelengths
from . import radiance_hdr
from .light_map import Kind, LightMap

_SPECTRAL = re.compile(rf"^(?:(?P<layer>.*)\.)?(?P<quantity>S[0-3]|T)\.{LENGTH}$")
_COLOURS: dict[Kind, tuple[str, ...]] = {"RGB": ("R", "G", "B"), "XYZ": ("X", "Y", "Z"), "luminance": ("Y",)}
# The value of OpenEXR's attribute `envmap` that is no latitude-longitude map.
_CUBE = 1
# Channels that a note names.
_SHOWN = 4
#: Peak bytes: of a stored sample while it is read, of a texel in each field of luminance, of a texel in the tables for
#: drawing directions, and of the rows whose spectra are reduced in one block. A tenth to a half above what maps of
#: 2048 x 1024 and 4096 x 2048 took.
BYTES_A_SAMPLE, BYTES_A_FIELD, BYTES_A_TEXEL, BYTES_OF_ROWS = 8, 16, 32, 250_000_000
#: Seconds a stored sample, and a texel of a map whose spectra are reduced, on one core of a small machine.
SECONDS_A_SAMPLE, SECONDS_A_REDUCED_TEXEL = 1e-7, 6e-6
#: Maps that take less time than this are read without a word.
SAID_FROM_SECONDS = 2.0


def read_map(
    path: str | Path, bad_texels: str | None = None, fields: int = 1, say: Callable[[str], None] | None = None
) -> LightMap:
    """Read an environment map.

    Of several layers the unnamed one is used, or the only one that holds light. RGB has the primaries stated in the
    file, or those of linear sRGB.

    Parameters
    ----------
    bad_texels : see `LightMap.without_bad_texels`.
    fields : number of luminance fields to be made of the map, for the estimate of memory.
    say : called with a message before a long step.

    Raises
    ------
    InputError
        A file that is missing, damaged or truncated; not twice as wide as high; cropped; channels or a texel that hold
        no light; more than fits into memory.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError("no such file", file=path, hint="paths in a scene file are relative to it")
    with path.open("rb") as file:
        head = file.read(10)
    if head.startswith(MAGIC):
        found = _from_exr(path, fields, say)
    elif head.startswith(b"#?"):
        found = _from_hdr(path, fields, say)
    else:
        raise InputError(
            "not a map of light",
            file=path,
            found=f"first bytes {head!r}" if head else "an empty file",
            expected="OpenEXR or Radiance (.hdr)",
            hint="export it as linear OpenEXR; pictures for displays are clipped and hold no light",
        )
    return found.without_bad_texels(bad_texels)


def _from_hdr(path: Path, fields: int, say: Callable[[str], None] | None) -> LightMap:
    header = radiance_hdr.read_header(path)
    _check_sides(path, header.height, header.width)
    MapCost(header.height * header.width, 3, fields).check_room(path, say)
    pixels = radiance_hdr.read_pixels(path, header)
    channels = tuple(pixels[..., index] for index in range(3))
    if header.is_xyz:
        return LightMap(path, "XYZ", channels)
    matrix, notes = _primaries(path, header.chromaticities, "PRIMARIES")
    return LightMap(path, "RGB", channels, None, matrix, notes)


def _from_exr(path: Path, fields: int, say: Callable[[str], None] | None) -> LightMap:
    headers = check_size(path, MOST_SAMPLES)
    attributes = headers[0].attributes
    _check_windows(path, attributes)
    samples = sum(header.area * len(header.names) for header in headers)
    texels = max(header.area for header in headers)
    MapCost(texels, -(-samples // max(texels, 1)), fields).check_room(path, say)
    picture = read_picture(path, MOST_SAMPLES)
    kind, layer, chosen = _light_of(path, picture.channels)
    shapes = sorted({pixels.shape for pixels in chosen.values()})
    if len(shapes) > 1:
        _refuse(path, "channels", "channels of different sizes", shapes, "one size for all")
    _check_sides(path, *shapes[0])
    notes = _left_out(picture.channels, layer, chosen)
    if kind == "spectra":
        grid = validated_wavelengths(sorted(chosen), file=path, field="S0 channels")
        if grid.size < 2:
            _refuse(path, "S0 channels", "one wavelength is no spectrum", f"{grid[0]:g} nm", "two or more")
        return LightMap(path, kind, tuple(chosen[length] for length in grid.tolist()), grid, None, notes)
    channels = tuple(chosen[name] for name in _COLOURS[kind])
    if kind != "RGB":
        return LightMap(path, kind, channels, None, None, notes)
    matrix, said = _primaries(path, attributes.get("chromaticities"), "chromaticities")
    return LightMap(path, kind, channels, None, matrix, (*said, *notes))


def _check_windows(path: Path, attributes: Mapping[str, Any]) -> None:
    """Raise `InputError` unless the header describes a whole latitude-longitude image."""
    if "envmap" in attributes and _whole(attributes["envmap"]) == _CUBE:
        _refuse(path, "envmap", "a cube map", "ENVMAP_CUBE", "latitude and longitude, twice as wide as high")
    windows = [
        [int(value) for corner in attributes[name] for value in corner]
        for name in ("dataWindow", "displayWindow")
        if name in attributes
    ]
    if len(windows) == 2 and windows[0] != windows[1]:
        problem = "a picture that is cropped, so that its directions are not known"
        _refuse(path, "dataWindow", problem, windows[0], f"the display window, {windows[1]}")
    left, top, right, bottom = windows[0]
    _check_sides(path, bottom - top + 1, right - left + 1)


def _whole(value: Any) -> int | None:
    try:
        return int(value)
    except (TypeError, ValueError):
        return None


def _check_sides(path: Path, height: int, width: int) -> None:
    if width != 2 * height or not height:
        raise InputError(
            "not a latitude-longitude map",
            file=path,
            field="size",
            found=f"{width} x {height}",
            expected="twice as wide as high: 360 by 180 degrees",
            hint="project it so: mirror balls, fisheyes and cubes are other projections, and a crop does not say where "
            "its texels lie",
        )


def _light_of(path: Path, channels: Mapping[str, np.ndarray]) -> tuple[Kind, str, dict[Any, np.ndarray]]:
    """Return the kind of light in an image, its layer, and its channels by name or wavelength."""
    spectral: dict[str, dict[float, np.ndarray]] = {}
    named: dict[str, dict[str, np.ndarray]] = {}
    no_light = set()
    for name, pixels in channels.items():
        if match := _SPECTRAL.match(name):
            if match["quantity"] != "S0":
                no_light.add(match["quantity"])
                continue
            held = spectral.setdefault(match["layer"] or "", {})
            length = wavelength_of(*match.group(3, 4, 5))
            if length in held:
                _refuse(path, name, "two channels hold the same wavelength", f"{length:g} nm", "each wavelength once")
            held[length] = pixels
        else:
            layer, _, last = name.rpartition(".")
            named.setdefault(layer, {})[last] = pixels
    if no_light and not spectral:
        held_only = ", ".join(sorted(no_light))
        _refuse(path, "channels", "a spectral picture without light", held_only, "S0 channels, which hold radiance")
    found: list[tuple[Kind, str, dict[Any, np.ndarray]]] = [("spectra", layer, at) for layer, at in spectral.items()]
    for layer, at in named.items() if not spectral else ():
        for kind, wanted in _COLOURS.items():
            if set(wanted) <= set(at):
                found.append((kind, layer, {name: at[name] for name in wanted}))
                break
    if not found:
        _refuse(path, "channels", "no light", ", ".join(list(channels)[:8]), "R, G, B or X, Y, Z or Y or S0 channels")
    main = [one for one in found if not one[1]] or found
    if len(main) > 1:
        layers = ", ".join(sorted(layer for _, layer, _ in main))
        _refuse(path, "channels", "which layer is the light?", layers, "one layer", "save that layer alone")
    return main[0]


def _left_out(channels: Mapping[str, np.ndarray], layer: str, chosen: Mapping[Any, np.ndarray]) -> tuple[str, ...]:
    """Return notes on channels that hold no light: alpha unless 1 everywhere, further layers, depth, ..."""
    taken = {id(pixels) for pixels in chosen.values()}
    others = [name for name, pixels in channels.items() if id(pixels) not in taken]
    notes = []
    alpha = f"{layer}.A" if layer else "A"
    if alpha in others:
        others.remove(alpha)
        if not (channels[alpha] == 1).all():
            notes.append("its alpha is not looked at: the light is taken as it stands")
    if any(_SPECTRAL.match(name) for name in channels):
        # The preview that the layout asks for.
        others = [name for name in others if name.rpartition(".")[2] not in ("R", "G", "B")]
    if others:
        more = f" and {len(others) - _SHOWN} more" if len(others) > _SHOWN else ""
        notes.append(f"channels that are not looked at: {', '.join(others[:_SHOWN])}{more}")
    return tuple(notes)


def _primaries(path: Path, stated: Any, field: str) -> tuple[Float[np.ndarray, "3 3"], tuple[str, ...]]:
    """Return the matrix XYZ from RGB for the primaries and white stated in a file (SMPTE RP 177-1993), and notes on
    assumptions.
    """
    if stated is None:
        note = "its RGB is taken to be linear, of the primaries of ITU-R BT.709 (sRGB): the file does not say"
        return xyz_from_rgb(), (note,)
    xy = np.array([float(value) for value in np.ravel(stated)])
    if xy.size == 8 and np.isfinite(xy).all() and xy[7] > 0.0:
        columns = np.stack([xy[0::2], xy[1::2], 1.0 - xy[0::2] - xy[1::2]])
        primaries, white = columns[:, :3], columns[:, 3] / columns[1, 3]
        if abs(np.linalg.det(primaries)) > 1e-6:
            return primaries * np.linalg.solve(primaries, white), ()
    _refuse(path, field, "no primaries of light", xy.tolist(), "x and y of red, green, blue and white")


def _refuse(
    path: Path, field: str, problem: str, found: object, expected: str, hint: str = "export the map again"
) -> NoReturn:
    raise InputError(problem, file=path, field=field, found=found, expected=expected, hint=hint)


@dataclass(frozen=True)
class MapCost:
    """Cost of reading a map of so many texels and channels, reduced to `fields` fields of luminance."""

    texels: int
    channels: int
    fields: int = 1

    @property
    def memory_bytes(self) -> int:
        """Peak memory, bytes."""
        texel = BYTES_A_SAMPLE * self.channels + BYTES_A_FIELD * self.fields + BYTES_A_TEXEL
        return self.texels * texel + BYTES_OF_ROWS * (self.fields > 1)

    @property
    def seconds(self) -> float:
        """Seconds on one core of a small machine."""
        return self.texels * (SECONDS_A_SAMPLE * self.channels + SECONDS_A_REDUCED_TEXEL * (self.fields > 1))

    @property
    def words(self) -> str:
        """Description of the cost."""
        return (
            f"{self.texels:,} texels of {self.channels} channels, up to {gigabytes(self.memory_bytes)} of memory and "
            f"{max(1.0, self.seconds):.0f} s"
        )

    def check_room(self, path: Path, say: Callable[[str], None] | None = None) -> None:
        """Raise `InputError` if this does not fit into free memory; announce long work through `say`."""
        check_room(
            self.memory_bytes,
            "the map does not fit into memory",
            self.words,
            "save it smaller: half the width takes a quarter; nothing is made smaller unasked",
            file=path,
        )
        if say is not None and self.seconds >= SAID_FROM_SECONDS:
            say(f"reading {path.name}: {self.words}")
