"""ICC profiles of one invented display in every form that displays come in, and damaged and unsuitable ones."""

import struct

import numpy as np
from metamer.calibration.display.icc import D50_XYZ

# Red, green and blue under D50, so far from sRGB that a profile which is ignored is noticed.
COLUMNS = np.array([[0.5151, 0.2920, 0.1571], [0.2412, 0.6922, 0.0666], [-0.0011, 0.0419, 0.7841]])
COLUMNS = COLUMNS * (D50_XYZ / COLUMNS.sum(axis=1))[:, None]
# The same display with less colour in each of its primaries.
DULL = 0.5 * COLUMNS + 0.5 * D50_XYZ[:, None] / 3.0
GAMMA = 2.2


def number(value: float) -> bytes:
    """s15Fixed16Number."""
    return struct.pack(">i", round(float(value) * 65536.0))


def xyz(values) -> bytes:
    return b"XYZ " + bytes(4) + b"".join(map(number, values))


def curve(values=(), gamma=None) -> bytes:
    """curveType."""
    codes = [round(gamma * 256.0)] if gamma else np.round(np.asarray(values) * 65535.0).astype(int)
    return b"curv" + bytes(4) + struct.pack(">I", len(codes)) + b"".join(struct.pack(">H", code) for code in codes)


def parametric(kind: int, *values: float) -> bytes:
    """parametricCurveType."""
    return b"para" + bytes(4) + struct.pack(">HH", kind, 0) + b"".join(map(number, values))


def named(text: str, version: int) -> bytes:
    """The description as version 2 or 4 writes it."""
    if version == 2:
        ascii = text.encode() + b"\0"
        return b"desc" + bytes(4) + struct.pack(">I", len(ascii)) + ascii + bytes(78)
    wide = text.encode("utf-16-be")
    return b"mluc" + bytes(4) + struct.pack(">II2s2sII", 1, 12, b"en", b"US", len(wide), 28) + wide


def profile(tags: dict[bytes, bytes], version=2, pcs=b"XYZ ", kind=b"mntr", space=b"RGB ", name="Desk") -> bytes:
    """A profile of these tags."""
    tags = {b"desc": named(name, version), b"cprt": b"text" + bytes(4) + b"none\0", b"wtpt": xyz(D50_XYZ), **tags}
    at, table, body = 132 + 12 * len(tags), b"", b""
    for tag, content in tags.items():
        table += tag + struct.pack(">II", at + len(body), len(content))
        body += content + bytes(-len(content) % 4)
    head = bytes(4) + bytes([version, 0x40 if version == 2 else 0x20, 0, 0]) + kind + space + pcs
    head += struct.pack(">6H", 2026, 1, 1, 0, 0, 0) + b"acsp" + bytes(28) + b"".join(map(number, D50_XYZ))
    head += bytes(124 - len(head))
    return struct.pack(">I", at + len(body)) + head + struct.pack(">I", len(tags)) + table + body


def matrix_profile(kind="table", columns=COLUMNS, **how) -> bytes:
    """Matrix and curves: a table, an exponent, or a parametric curve (sRGB's)."""
    one = {
        "table": curve(np.linspace(0.0, 1.0, 1024) ** GAMMA),
        "gamma": curve(gamma=GAMMA),
        "parametric": parametric(3, 2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045),
    }[kind]
    tags = {channel + b"TRC": one for channel in (b"r", b"g", b"b")}
    tags |= {channel + b"XYZ": xyz(columns[:, at]) for at, channel in enumerate((b"r", b"g", b"b"))}
    return profile(tags, **how)


def _grid(count: int) -> np.ndarray:
    steps = np.linspace(0.0, 1.0, count)
    return np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)


def _lightness(xyz_d50: np.ndarray) -> np.ndarray:
    t = xyz_d50 / D50_XYZ
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], axis=1)


def _from_lightness(lab: np.ndarray) -> np.ndarray:
    fy = (lab[:, 0] + 16) / 116
    f = np.stack([fy + lab[:, 1] / 500, fy, fy - lab[:, 2] / 200], axis=1)
    return D50_XYZ * np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29))


def _shown(codes: np.ndarray, columns: np.ndarray) -> np.ndarray:
    return codes**GAMMA @ columns.T


def _sent(xyz_d50: np.ndarray, columns: np.ndarray) -> np.ndarray:
    return np.clip(xyz_d50 @ np.linalg.inv(columns).T, 0.0, 1.0) ** (1.0 / GAMMA)


def _packed(values: np.ndarray, wide=True) -> bytes:
    top, kind = (65535.0, ">u2") if wide else (255.0, "u1")
    return np.round(np.clip(values, 0.0, 1.0) * top).astype(kind).tobytes()


def _cubes(pcs: bytes, legacy: bool, count: int, columns: np.ndarray = COLUMNS) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the cube to the connection space and of that back."""
    codes = _grid(count)
    if pcs == b"XYZ ":
        scale = 32768.0 / 65535.0
        return _shown(codes, columns) * scale, _sent(codes / scale, columns)
    scale = 65280.0 / 65535.0 if legacy else 1.0
    size, first = np.array([100.0, 255.0, 255.0]), np.array([0.0, -128.0, -128.0])
    lab = (_lightness(_shown(codes, columns)) - first) / size * scale
    return lab, _sent(_from_lightness(codes / scale * size + first), columns)


def old_tables(pcs=b"Lab ", wide=True, count=17, columns=COLUMNS, **how) -> bytes:
    """Tables of lut16Type, or lut8Type."""
    tags, ramp = {}, np.tile(np.linspace(0.0, 1.0, 2 if wide else 256), 3)
    for tag, cube in zip((b"A2B0", b"B2A0"), _cubes(pcs, wide, count, columns), strict=True):
        head = (b"mft2" if wide else b"mft1") + bytes(4) + bytes([3, 3, count, 0])
        head += b"".join(map(number, np.eye(3).ravel())) + (struct.pack(">HH", 2, 2) if wide else b"")
        tags[tag] = head + _packed(ramp, wide) + _packed(cube, wide) + _packed(ramp, wide)
    return profile(tags, pcs=pcs, **how)


def new_tables(count=17, **how) -> bytes:
    """Tables of lutAToBType and lutBToAType with every element: curves A, cube, curves M, matrix, curves B."""
    tags = {}
    bent, straight = np.linspace(0.0, 1.0, 512) ** 1.8, [curve()] * 3
    for tag, kind, cube in zip((b"A2B0", b"B2A0"), (b"mAB ", b"mBA "), _cubes(b"Lab ", False, count), strict=True):
        # A matrix and curves that undo each other, so that leaving one of them out is noticed.
        half = b"".join(map(number, (np.eye(3) * 0.5).ravel())) + b"".join(map(number, [0.25, 0.25, 0.25]))
        undone = [parametric(1, 1.0, 2.0, -0.5)] * 3
        double = b"".join(map(number, (np.eye(3) * 2.0).ravel())) + b"".join(map(number, [-0.5, -0.5, -0.5]))
        halved = [parametric(1, 1.0, 0.5, 0.25)] * 3
        if kind == b"mBA ":
            # Order from the connection space: B as it is, halved, undone, cube, A.
            at_a, parts = [curve(bent)] * 3, (straight, half, undone)
            cube = np.interp(cube, bent, np.linspace(0.0, 1.0, 512))
        else:
            at_a, parts = straight, (straight, double, halved)
        body = b"".join(parts[0])
        starts = {"B": 32, "matrix": 32 + len(body)}
        body += parts[1]
        starts["M"] = 32 + len(body)
        body += b"".join(parts[2])
        starts["cube"] = 32 + len(body)
        body += bytes([count] * 3) + bytes(13) + bytes([2, 0, 0, 0]) + _packed(cube)
        body += bytes(-len(body) % 4)
        starts["A"] = 32 + len(body)
        body += b"".join(one + bytes(-len(one) % 4) for one in at_a)
        order = ("B", "matrix", "M", "cube", "A")
        tags[tag] = kind + bytes(4) + bytes([3, 3, 0, 0]) + struct.pack(">5I", *(starts[name] for name in order)) + body
    return profile(tags, version=4, pcs=b"Lab ", **how)


#: Name and bytes of each form.
FORMS = {
    "matrix and a table, version 2": matrix_profile("table"),
    "matrix and an exponent, version 2": matrix_profile("gamma"),
    "matrix and a parametric curve, version 4": matrix_profile("parametric", version=4),
    "tables of 16 bits to Lab, version 2": old_tables(),
    "tables of 16 bits to XYZ, version 2": old_tables(b"XYZ ", count=33),
    "tables of 16 bits to Lab, version 4": old_tables(version=4),
    "tables of 8 bits to Lab, version 2": old_tables(wide=False),
    "tables with all elements, version 4": new_tables(),
}
