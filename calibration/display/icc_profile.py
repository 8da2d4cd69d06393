"""ICC profiles of displays as transforms of OpenColorIO: matrix and curves or look-up tables, versions 2 and 4.

OpenColorIO reads the matrix and curves of a profile but no tables. Here the elements of either kind become its own
operators (powers, matrices, curves, cubes), so that CPU and GPU agree. Colours are relative to the profile's white:
XYZ-D65 of pictures is adapted to the D50 of the connection space by Bradford, as in the making of profiles. Clause
numbers are of ICC.1:2022 (version 4.4).
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ...runtime.errors import InputError
from ...runtime.files import existing_file
from ...spectral.adaptation import adaptation_matrix
from .aim import PICTURE_WHITE_XYZ
from .icc import D50_XYZ

#: Begins the name of a profile's file in place of a display of a configuration; and the profile that the system has for
#: its first screen.
PREFIX = "icc:"
SCREEN = f"{PREFIX}screen"
# Device classes by their signatures (7.2.5), and the two whose colours a screen can be sent.
_CLASSES = {
    b"mntr": "a display profile",
    b"spac": "a colour space",
    b"prtr": "a printer profile",
    b"scnr": "a scanner or camera profile",
    b"link": "a device link",
    b"abst": "an abstract profile",
    b"nmcl": "a list of named colours",
}
_SHOWABLE = (b"mntr", b"spac")
# Matrix and curves of red, green and blue (8.4.3).
_MATRIX_TAGS = tuple(tag + kind for tag in (b"r", b"g", b"b") for kind in (b"XYZ", b"TRC"))
# The intent is media-relative colorimetric; perceptual tables serve where a profile has no others (8.4.2).
_TO_PCS, _FROM_PCS = (b"A2B1", b"A2B0"), (b"B2A1", b"B2A0")
# Tone curves go on past 0 and 1 as those of sRGB leave there: codes out of range are counted, not shown.
_BELOW, _ABOVE = 12.92, 1.0 / 2.2
# Samples of a parametric curve, closer towards black.
_SAMPLES = 16385
# XYZ in the connection space: 1 is 0x8000 of 16 bits (6.3.4.2).
_XYZ_SCALE = 32768.0 / 65535.0
# White of Lab as a fraction of the codes of 16 bits in tables of version 2, where 0xFF00 is 100 (10.10, table 40).
_LEGACY = 65280.0 / 65535.0
_LARGEST_CUBE = 129
# Bytes of the header, and of the number of tags.
_HEADER = 132
# Largest difference in X or Z at which a white is D50 itself.
_SAME_WHITE = 2e-3


@dataclass(frozen=True, eq=False)
class ToneCurve:
    """Piecewise linear curve. x, y : (n,) knots, x ascending."""

    x: Float[np.ndarray, " n"]
    y: Float[np.ndarray, " n"]

    def at(self, x: np.ndarray) -> np.ndarray:
        """Evaluate the curve, clamped beyond the ends."""
        return np.interp(x, self.x, self.y)

    def back(self, y: np.ndarray) -> np.ndarray:
        """Invert the curve: black and white are the first and the last code; linear beyond them, as sRGB's."""
        low, high = self.y[0], self.y[-1]
        within = np.where(y <= low, self.x[0], np.interp(y, self.y, self.x))
        return within + np.minimum(y - low, 0.0) * _BELOW + np.maximum(y - high, 0.0) * _ABOVE

    @property
    def is_identity(self) -> bool:
        """True for the identity."""
        return bool(np.array_equal(self.x, self.y))


@dataclass(frozen=True, eq=False)
class _Matrix:
    """Affine element. matrix : (3,3). offset : (3,)."""

    matrix: Float[np.ndarray, "3 3"]
    offset: Float[np.ndarray, "3"]

    def ops(self) -> list[Any]:
        import PyOpenColorIO as ocio

        full, offset = np.eye(4), np.zeros(4)
        full[:3, :3], offset[:3] = self.matrix, self.offset
        return [ocio.MatrixTransform(full.ravel().tolist(), offset.tolist())]


@dataclass(frozen=True, eq=False)
class _Curves:
    """Curves of three channels. back : inverse, from light to codes, for every number."""

    curves: tuple[ToneCurve, ...]
    back: bool = False

    def ops(self) -> list[Any]:
        import PyOpenColorIO as ocio

        if all(curve.is_identity for curve in self.curves) and not self.back:
            # Tables end where the codes do.
            return [ocio.RangeTransform(0.0, 1.0, 0.0, 1.0)]
        # At every half float: relative steps, as dark colours need them.
        halves = np.arange(65536, dtype=np.uint16).view(np.float16).astype(np.float64)
        at = np.nan_to_num(halves, nan=0.0, posinf=65504.0, neginf=-65504.0)
        values = [curve.back(at) if self.back else curve.at(at) for curve in self.curves]
        table = ocio.Lut1DTransform(65536, True)
        table.setData(np.ascontiguousarray(np.stack(values, axis=1), dtype=np.float32))
        return [table]


@dataclass(frozen=True, eq=False)
class _Cube:
    """Cube element. nodes : (n,n,n,3), the input's last axis fastest. tetrahedral : interpolation; else trilinear."""

    nodes: Float[np.ndarray, "n n n 3"]
    tetrahedral: bool

    def ops(self) -> list[Any]:
        import PyOpenColorIO as ocio

        cube = ocio.Lut3DTransform(len(self.nodes))
        cube.setData(np.ascontiguousarray(self.nodes, dtype=np.float32))
        cube.setInterpolation(ocio.INTERP_TETRAHEDRAL if self.tetrahedral else ocio.INTERP_LINEAR)
        return [cube]


@dataclass(frozen=True, eq=False)
class _Lightness:
    """Conversion between XYZ relative to D50 and L*, a*, b* in [0, 1], by matrices and the curve of L*.

    decoding : to XYZ. scale : code of L* = 100.
    """

    decoding: bool
    scale: float

    def ops(self) -> list[Any]:
        import PyOpenColorIO as ocio

        # f(t) = (116 t^(1/3) - 16 + 16) / 116 is (L(t) + 0.16) / 1.16 with the curve of lightness L, straight near 0
        # (CIE 15): OpenColorIO's power with an offset of 0.16 and an exponent of 3.
        curve = ocio.ExponentWithLinearTransform(gamma=[3.0] * 3 + [1.0], offset=[0.16] * 3 + [0.0])
        curve.setNegativeStyle(ocio.NEGATIVE_LINEAR)
        # L* / 100 and (a* + 128) / 255 of L by axis; a* = 500 / 1.16 (Lx - Ly), b* = 200 / 1.16 (Ly - Lz).
        a, b = 500.0 / 1.16 / 255.0, 200.0 / 1.16 / 255.0
        matrix = np.array([[0.0, 1.0, 0.0], [a, -a, 0.0], [0.0, b, -b]]) * self.scale
        offset = np.array([0.0, 128.0, 128.0]) / 255.0 * self.scale
        white = _Matrix(np.diag(1.0 / D50_XYZ), np.zeros(3))
        if not self.decoding:
            curve.setDirection(ocio.TRANSFORM_DIR_INVERSE)
            return [*white.ops(), curve, *_Matrix(matrix, offset).ops()]
        back = np.linalg.inv(matrix)
        return [*_Matrix(back, -back @ offset).ops(), curve, *_Matrix(np.diag(D50_XYZ), np.zeros(3)).ops()]


@dataclass(frozen=True, eq=False)
class DisplayProfile:
    """ICC profile of a display, read from a file.

    Parameters
    ----------
    path, name : the file, and its description. data : its bytes.
    version : such as "2.4". form : "matrix and curves", or the size of its tables.
    white_xyz : (3,) of the display itself, Y = 1; None if the file states D50, as profiles of version 2 do that do not
        know it.
    forward, backward : elements from codes to the connection space, XYZ relative to D50, and from there to codes.
    has_limits : tables end at the display's gamut and map colours beyond to the nearest, by the profile's maker.
    loads_curves : it is valid only while its curves are loaded into the video card.
    """

    path: Path
    name: str
    data: bytes
    version: str
    form: str
    white_xyz: Float[np.ndarray, "3"] | None
    forward: tuple[Any, ...]
    backward: tuple[Any, ...]
    has_limits: bool
    loads_curves: bool

    @cached_property
    def from_xyz_d65(self) -> Any:
        """OCIO transform from XYZ-D65 of pictures, Y of white 1, to codes."""
        return _group(_Matrix(adaptation_matrix(PICTURE_WHITE_XYZ, D50_XYZ), np.zeros(3)), *self.backward)

    @cached_property
    def to_xyz_d65(self) -> Any:
        """OCIO transform from codes to XYZ-D65, Y of white 1."""
        return _group(*self.forward, _Matrix(adaptation_matrix(D50_XYZ, PICTURE_WHITE_XYZ), np.zeros(3)))

    def xyz(
        self, codes: Float[np.ndarray, "N 3"], white_xyz: Float[np.ndarray, "3"] | None = None
    ) -> Float[np.ndarray, "N 3"]:
        """Compute XYZ of codes, Y of white 1, adapted from D50 by Bradford, as the standard adapts to it (annex E).

        white_xyz : the white to adapt to; None: the display's own, which must be known.
        """
        import PyOpenColorIO as ocio

        white = self.white_xyz if white_xyz is None else white_xyz
        assert white is not None
        found = np.array(codes, dtype=np.float32, order="C")
        exact_on_cpu(ocio.Config.CreateRaw().getProcessor(_group(*self.forward))).applyRGB(found)
        return found.astype(np.float64) @ adaptation_matrix(D50_XYZ, white).T

    def describe(self) -> list[str]:
        """Describe the profile for a report."""
        words = [
            f"ICC profile {self.path}, “{self.name}”, version {self.version}, {self.form}, relative colorimetric: the "
            "white of pictures is shown as the display's own."
        ]
        if self.loads_curves:
            words.append(
                "The profile holds while its curves (tag vcgt) are loaded into the video card, by the system or the "
                "program that made it."
            )
        return words


def exact_on_cpu(processor: Any) -> Any:
    """Return a lossless OCIO processor for the CPU, float32.

    The default optimisation approximates powers with larger errors than the GPU.
    """
    import PyOpenColorIO as ocio

    depth = ocio.BIT_DEPTH_F32
    return processor.getOptimizedCPUProcessor(depth, depth, ocio.OPTIMIZATION_LOSSLESS)


def _group(*elements: Any) -> Any:
    import PyOpenColorIO as ocio

    return ocio.GroupTransform([op for element in elements for op in element.ops()])


def read_display_profile(path: str | Path, data: bytes | None = None) -> DisplayProfile:
    """Read an ICC profile of a display.

    data : its bytes, if already read; `path` is then a name for messages.

    Raises
    ------
    InputError : no such file, cut short, not of a display (a printer's, a scanner's ...), not of red, green and blue,
        without a required tag, or with an element outside the standard.
    """
    path = Path(path)
    try:
        if data is None:
            with existing_file(path).open("rb") as file:
                # Whatever else somebody names is not read as a whole.
                data = file.read(_HEADER)
                data += file.read() if data[36:40] == b"acsp" else b""
        return _Reader(path, data).profile()
    except OSError as reason:
        hint = "check that it may be read"
        raise InputError("the profile cannot be read", file=path, found=reason.strerror, hint=hint) from None


class _Reader:
    """Reader of one profile's bytes."""

    def __init__(self, path: Path, data: bytes) -> None:
        self.path, self.data = path, data
        if len(data) < _HEADER or data[36:40] != b"acsp":
            found = repr(data[36:40])[1:] if len(data) >= _HEADER else f"{len(data)} bytes in all"
            raise self._wrong("not an ICC profile", "its first bytes", found, "`acsp` at byte 36",
                              "name the .icc or .icm file of the display")  # fmt: skip
        (size,) = struct.unpack(">I", data[:4])
        if size > len(data):
            raise self._wrong("the profile is cut short", "its size", f"{len(data)} bytes", f"{size} bytes",
                              "copy it once more")  # fmt: skip
        kind, space, pcs = data[12:16], data[16:20], data[20:24]
        if kind not in _SHOWABLE:
            found = _CLASSES.get(kind, repr(kind))
            raise self._wrong("not a profile of a display", "device class", found, "a display profile (mntr)",
                              "name the profile that the system uses for this screen")  # fmt: skip
        if space != b"RGB ":
            raise self._wrong("not a profile of red, green and blue", "colour space", _text(space), "RGB")
        if pcs not in (b"XYZ ", b"Lab "):
            raise self._wrong("an unknown connection space", "connection space", _text(pcs), "XYZ or Lab")
        self.pcs = pcs
        self.version = f"{data[8]}.{data[9] >> 4}"
        if data[8] not in (2, 4):
            raise self._wrong("an unknown version", "version", self.version, "2 or 4")
        self.tags = dict(self._tags())

    def _wrong(
        self, problem: str, field: str, found: str | None = None, expected: str | None = None, hint: str | None = None
    ) -> InputError:
        hint = hint or (None if expected else "make the profile anew, or fetch it once more")
        return InputError(problem, file=self.path, field=field, found=found, expected=expected, hint=hint)

    def _tags(self) -> Iterable[tuple[bytes, bytes]]:
        (count,) = struct.unpack(">I", self.data[128:132])
        if 132 + 12 * count > len(self.data):
            raise self._wrong("the profile is cut short", "table of tags", f"{len(self.data)} bytes",
                              f"{132 + 12 * count} bytes or more")  # fmt: skip
        for at in range(132, 132 + 12 * count, 12):
            tag, start, size = struct.unpack(">4sII", self.data[at : at + 12])
            if start + size > len(self.data):
                raise self._wrong("the profile is cut short", f"tag {_text(tag)}", f"{len(self.data)} bytes",
                                  f"{start + size} bytes", "copy it once more")  # fmt: skip
            yield tag, self.data[start : start + size]

    def profile(self) -> DisplayProfile:
        """Return the profile; tables take precedence over matrix and curves, as in the standard (8.4.1)."""
        to_pcs = next((tag for tag in _TO_PCS if tag in self.tags), None)
        from_pcs = next((tag for tag in _FROM_PCS if tag in self.tags), None)
        if (to_pcs is None) != (from_pcs is None):
            tag, absent = (to_pcs, "B2A0") if to_pcs else (from_pcs, "A2B0")
            raise self._wrong("tables in one direction alone", f"tag {_text(tag or b'')}", f"no {absent}", absent)
        if to_pcs and from_pcs:
            forward, backward = self._tables(to_pcs, to_pcs=True), self._tables(from_pcs, to_pcs=False)
            form = ", ".join(
                f"{_text(tag)} a table of {len(element.nodes)}³"
                for tag, elements in ((to_pcs, forward), (from_pcs, backward))
                for element in elements
                if isinstance(element, _Cube)
            )
        else:
            forward, backward = self._matrix_and_curves()
            form = ""
        has_limits = any(isinstance(element, _Cube) for element in backward)
        return DisplayProfile(
            self.path,
            self._description(),
            self.data,
            self.version,
            form or "matrix and curves",
            self._white(),
            tuple(forward),
            tuple(backward),
            has_limits,
            b"vcgt" in self.tags,
        )

    def _matrix_and_curves(self) -> tuple[list[Any], list[Any]]:
        absent = [_text(tag) for tag in _MATRIX_TAGS if tag not in self.tags]
        if absent:
            raise self._wrong("the profile lacks a tag", "tags", f"no {', '.join(absent)}",
                              "rXYZ, gXYZ, bXYZ, rTRC, gTRC and bTRC, or tables (A2B0, B2A0)")  # fmt: skip
        if self.pcs != b"XYZ ":
            raise self._wrong("matrix and curves lead to XYZ", "connection space", "Lab", "XYZ")
        columns = np.stack([self._xyz(channel + b"XYZ") for channel in (b"r", b"g", b"b")], axis=1)
        if not abs(np.linalg.det(columns)) > 1e-6:
            raise self._wrong("red, green and blue of the profile lie in one plane", "rXYZ, gXYZ, bXYZ")
        curves = tuple(
            self._curve(self.tags[channel + b"TRC"], f"tag {_text(channel)}TRC")[0] for channel in (b"r", b"g", b"b")
        )
        for channel, curve in zip("rgb", curves, strict=True):
            if np.any(np.diff(curve.y) < 0.0) or not curve.y[-1] > curve.y[0]:
                raise self._wrong("a tone curve that goes back", f"tag {channel}TRC",
                                  expected="light that grows with the code", hint="make the profile anew")  # fmt: skip
        back = np.linalg.inv(columns)
        forward = [_Curves(curves), _Matrix(columns, np.zeros(3))]
        return forward, [_Matrix(back, np.zeros(3)), _Curves(curves, back=True)]

    def _tables(self, tag: bytes, to_pcs: bool) -> list[Any]:
        """Read the elements of a tag with tables, the connection space as XYZ relative to D50."""
        data, field = self.tags[tag], f"tag {_text(tag)}"
        kind = data[:4]
        if kind in (b"mft1", b"mft2"):
            inner = self._old_tables(data, field)
        elif kind == (b"mAB " if to_pcs else b"mBA "):
            inner = self._new_tables(data, field, to_pcs)
        else:
            raise self._wrong("an unknown kind of table", field, _text(kind), "mft1, mft2, mAB or mBA")
        # Tables of lut16Type have Lab as version 2 encodes it, whatever the profile's version (10.10).
        scale = _LEGACY if kind == b"mft2" else 1.0
        if self.pcs == b"Lab ":
            outside: Any = _Lightness(to_pcs, scale)
        else:
            outside = _Matrix(np.eye(3) * (1.0 / _XYZ_SCALE if to_pcs else _XYZ_SCALE), np.zeros(3))
        return [*inner, outside] if to_pcs else [outside, *inner]

    def _old_tables(self, data: bytes, field: str) -> list[Any]:
        """Read lut8Type and lut16Type (10.11, 10.10): a matrix before XYZ, input curves, cube, output curves."""
        wide = data[:4] == b"mft2"
        if len(data) < 52:
            raise self._short(data, field, 52)
        channels, grid = data[8:10], data[10]
        self._three(channels, field)
        matrix = np.array(struct.unpack(">9i", data[12:48])).reshape(3, 3) / 65536.0
        entries = struct.unpack(">2H", data[48:52]) if wide else (256, 256)
        if min(entries) < 2 or grid < 2:
            raise self._wrong("a table without entries", field, f"{entries} in curves, {grid} along the cube")
        if grid > _LARGEST_CUBE:
            raise self._wrong("a cube that OpenColorIO does not have", field, str(grid), f"at most {_LARGEST_CUBE}")
        size, start, top = (2, 52, 65535.0) if wide else (1, 48, 255.0)
        counts = (3 * entries[0], 3 * grid**3, 3 * entries[1])
        if len(data) < start + size * sum(counts):
            raise self._short(data, field, start + size * sum(counts))
        values = np.frombuffer(data, ">u2" if wide else "u1", sum(counts), start) / top
        before, cube, after = np.split(values, np.cumsum(counts)[:2])
        elements: list[Any] = []
        if self.pcs == b"XYZ " and field.startswith("tag B2A") and not np.array_equal(matrix, np.eye(3)):
            elements.append(_Matrix(matrix, np.zeros(3)))
        elements.append(_Curves(_even(before.reshape(3, -1))))
        elements.append(_Cube(cube.reshape(grid, grid, grid, 3), self._tetrahedral(field)))
        elements.append(_Curves(_even(after.reshape(3, -1))))
        return elements

    def _new_tables(self, data: bytes, field: str, to_pcs: bool) -> list[Any]:
        """Read lutAToBType and lutBToAType (10.12, 10.13): curves A, cube, curves M, matrix, curves B, or back."""
        if len(data) < 32:
            raise self._short(data, field, 32)
        self._three(data[8:10], field)
        at = dict(zip(("B", "matrix", "M", "cube", "A"), struct.unpack(">5I", data[12:32]), strict=True))
        read: dict[str, Callable[[int], Any]] = {
            "B": lambda start: self._three_curves(data, start, f"{field}, curves B"),
            "matrix": lambda start: self._offset_matrix(data, start, field),
            "M": lambda start: self._three_curves(data, start, f"{field}, curves M"),
            "cube": lambda start: self._cube(data, start, field),
            "A": lambda start: self._three_curves(data, start, f"{field}, curves A"),
        }
        if not at["B"]:
            raise self._wrong("a table without curves B", field)
        order = ("A", "cube", "M", "matrix", "B") if to_pcs else ("B", "matrix", "M", "cube", "A")
        return [read[name](at[name]) for name in order if at[name]]

    def _three_curves(self, data: bytes, start: int, field: str) -> _Curves:
        curves = []
        for _ in range(3):
            curve, size = self._curve(data[start:], field)
            curves.append(curve)
            # Each begins at a multiple of four bytes.
            start += size + (-size) % 4
        return _Curves(tuple(curves))

    def _offset_matrix(self, data: bytes, start: int, field: str) -> _Matrix:
        if len(data) < start + 48:
            raise self._short(data, field, start + 48)
        values = np.array(struct.unpack(">12i", data[start : start + 48])) / 65536.0
        return _Matrix(values[:9].reshape(3, 3), values[9:])

    def _cube(self, data: bytes, start: int, field: str) -> _Cube:
        if len(data) < start + 20:
            raise self._short(data, field, start + 20)
        grid, size = tuple(data[start : start + 3]), data[start + 16]
        if len(set(grid)) != 1 or not 2 <= grid[0] <= _LARGEST_CUBE or size not in (1, 2):
            raise self._wrong("a cube that OpenColorIO does not have", field, f"{grid}, {size} bytes a number",
                              f"one size along three axes, 2 to {_LARGEST_CUBE}")  # fmt: skip
        count = 3 * grid[0] ** 3
        if len(data) < start + 20 + size * count:
            raise self._short(data, field, start + 20 + size * count)
        values = np.frombuffer(data, ">u2" if size == 2 else "u1", count, start + 20) / (256.0**size - 1.0)
        return _Cube(values.reshape(*grid, 3), self._tetrahedral(field))

    def _tetrahedral(self, field: str) -> bool:
        """Return whether a cube is interpolated tetrahedrally along its grey diagonal; not for L*, a*, b* input."""
        return self.pcs == b"XYZ " or field.startswith("tag A2B")

    def _curve(self, data: bytes, field: str) -> tuple[ToneCurve, int]:
        """Read curveType or parametricCurveType (10.6, 10.18); also return its length in bytes."""
        if len(data) < 12:
            raise self._short(data, field, 12)
        if data[:4] == b"curv":
            (count,) = struct.unpack(">I", data[8:12])
            if len(data) < 12 + 2 * count:
                raise self._short(data, field, 12 + 2 * count)
            values = np.frombuffer(data, ">u2", count, 12)
            if count == 0:
                curve = ToneCurve(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
            elif count == 1:
                curve = _sampled(lambda x: x ** (float(values[0]) / 256.0))
            else:
                curve = ToneCurve(np.linspace(0.0, 1.0, count), values / 65535.0)
            return curve, 12 + 2 * count
        if data[:4] == b"para":
            (kind,) = struct.unpack(">H", data[8:10])
            if kind > 4:
                raise self._wrong("an unknown curve", field, f"parametric curve {kind}", "0 to 4")
            count = (1, 3, 4, 5, 7)[kind]
            if len(data) < 12 + 4 * count:
                raise self._short(data, field, 12 + 4 * count)
            return self._parametric(struct.unpack(f">{count}i", data[12 : 12 + 4 * count]), field), 12 + 4 * count
        raise self._wrong("an unknown curve", field, _text(data[:4]), "curv or para")

    def _parametric(self, parameters: tuple[int, ...], field: str) -> ToneCurve:
        """Evaluate Y = (aX + b)^g + e from X = d on, cX + f below (table 68); other forms are special cases."""
        values = [value / 65536.0 for value in parameters]
        g, a, b = values[0], 1.0, 0.0
        c = d = e = f = 0.0
        if len(values) > 1:
            a, b = values[1], values[2]
        if len(values) in (3, 4) and a == 0.0:
            raise self._wrong("a curve that divides by nothing", field, "a = 0")
        if len(values) in (3, 4):
            d = -b / a
        if len(values) == 4:
            e = f = values[3]
        elif len(values) >= 5:
            c, d = values[3], values[4]
        if len(values) == 7:
            e, f = values[5], values[6]

        def value(x: np.ndarray) -> np.ndarray:
            # The base of the power may be negative below d, where the power is not used.
            return np.where(x >= d, np.maximum(a * x + b, 0.0) ** g + e, c * x + f)

        if not g > 0.0:
            raise self._wrong("a curve that does not rise", field, f"an exponent of {g:g}", "more than 0")
        return _sampled(value)

    def _xyz(self, tag: bytes) -> np.ndarray:
        data = self.tags[tag]
        if data[:4] != b"XYZ " or len(data) < 20:
            raise self._wrong("not three numbers X, Y, Z", f"tag {_text(tag)}", _text(data[:4]), "XYZ")
        return np.array(struct.unpack(">3i", data[8:20])) / 65536.0

    def _white(self) -> np.ndarray | None:
        """Return the white of the display.

        By the matrix that adapted it (chad, 9.2.15), else the media white unless it is D50, which version 4 always
        states there (9.2.36).
        """
        if b"chad" in self.tags:
            data = self.tags[b"chad"]
            if data[:4] != b"sf32" or len(data) < 44:
                raise self._wrong("not nine numbers", "tag chad", _text(data[:4]), "sf32")
            matrix = np.array(struct.unpack(">9i", data[8:44])).reshape(3, 3) / 65536.0
            if not abs(np.linalg.det(matrix)) > 1e-6:
                raise self._wrong("a matrix that cannot be turned round", "tag chad")
            white = np.linalg.solve(matrix, D50_XYZ)
        elif b"wtpt" in self.tags:
            white = self._xyz(b"wtpt")
        else:
            return None
        if not (white > 0.0).all():
            raise self._wrong("a white without light", "tag wtpt or chad", str(white), "X, Y and Z above 0")
        white = white / white[1]
        return None if np.abs(white - D50_XYZ).max() < _SAME_WHITE else white

    def _three(self, channels: bytes, field: str) -> None:
        if tuple(channels) != (3, 3):
            raise self._wrong(
                "a table of other than three channels", field, f"{channels[0]} to {channels[1]}", "3 to 3"
            )

    def _short(self, data: bytes, field: str, expected: int) -> InputError:
        return self._wrong("the profile is cut short", field, f"{len(data)} bytes", f"{expected} bytes")

    def _description(self) -> str:
        """Return the description (textDescriptionType of version 2, multiLocalizedUnicodeType of 4), else the name of
        the file.
        """
        data = self.tags.get(b"desc", b"")
        name = ""
        if data[:4] == b"desc" and len(data) >= 12:
            (count,) = struct.unpack(">I", data[8:12])
            name = data[12 : 12 + count].split(b"\0")[0].decode("latin-1")
        elif data[:4] == b"mluc" and len(data) >= 28 and struct.unpack(">I", data[8:12])[0]:
            size, start = struct.unpack(">II", data[20:28])
            name = data[start : start + size].decode("utf-16-be", "replace").split("\0")[0]
        return " ".join(name.split()) or self.path.stem


def _sampled(value: Callable[[np.ndarray], np.ndarray]) -> ToneCurve:
    x = np.linspace(0.0, 1.0, _SAMPLES) ** 3
    return ToneCurve(x, np.clip(value(x), 0.0, 1.0))


def _even(values: Float[np.ndarray, "3 n"]) -> tuple[ToneCurve, ...]:
    x = np.linspace(0.0, 1.0, values.shape[1])
    return tuple(ToneCurve(x, row) for row in values)


def _text(signature: bytes) -> str:
    return signature.decode("latin-1").strip() or repr(signature)
