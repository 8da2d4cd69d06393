"""Small files of every format, written here, to be damaged by `fuzz`."""

from __future__ import annotations

import io
import json
import struct
import tempfile
import warnings
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from metamer.materials.formats.rgl import write_tensors
from metamer.materials.measured.merl import SHAPE
from metamer.spectral.formats.csv_writer import write_csv
from metamer.spectral.formats.cxf_writer import write_cxf
from metamer.spectral.formats.exr import write_exr
from metamer.spectral.formats.registry import SpectralEntry, StatedColour
from metamer.spectral.spectrum import Spectrum
from small_files import CHART, LAMP, METER, TABLE_ACROSS, TM27

NM = np.arange(400.0, 701.0, 20.0)
SHADES = "".join(
    f"[{kind}_DATA 0],\r\n{of}_NAME=a,\r\n{of}_REFLPOINTS=4,\r\n{of}_REFLINTERVAL=10,\r\n{of}_REFLLOW=400,\r\n"
    f"{of}_VIEWING=%R USAV SCI UV Inc,\r\nILLNAME=D65 10 Deg,\r\n{of}_X=20,\r\n{of}_R={values},\r\n"
    for kind, of, values in (("STANDARD", "STD", "5.1,6.2,7.3,8.4"), ("BATCH", "BAT", "5,1;6,2;7,3;8,4"))
)
PACKED = """##TITLE= outer
##DATA TYPE= LINK
##BLOCKS= 2
##TITLE= tile
##DATA TYPE= UV/VIS SPECTRUM
##XUNITS= NANOMETERS
##YUNITS= REFLECTANCE
##XFACTOR= 1
##YFACTOR= 0.001
##FIRSTX= 400
##LASTX= 460
##NPOINTS= 7
##FIRSTY= 0.3
##XYDATA= (X++(Y..Y))
400C00J0S%j1
430B99%TJ
460C00
##END=
##TITLE= glass
##XUNITS= 1/CM
##YUNITS= %T
##NPOINTS= 3
##XYPOINTS= (XY..XY)
25000, 80.5; 20000, 81.5; 15000, ?
##END=
##END=
"""
BOOK = {
    "[Content_Types].xml": '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default '
    'Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="xml" '
    'ContentType="application/xml"/><Override PartName="/xl/workbook.xml" ContentType="application/vnd.openxmlformats-'
    'officedocument.spreadsheetml.sheet.main+xml"/><Override PartName="/xl/worksheets/sheet1.xml" ContentType='
    '"application/vnd.openxmlformats-officedocument.spreadsheetml.worksheet+xml"/></Types>',
    "_rels/.rels": '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship '
    'Id="r1" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/officeDocument" '
    'Target="xl/workbook.xml"/></Relationships>',
    "xl/workbook.xml": '<workbook xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main" xmlns:r='
    '"http://schemas.openxmlformats.org/officeDocument/2006/relationships"><sheets><sheet name="A" sheetId="1" '
    'r:id="r1"/></sheets></workbook>',
    "xl/_rels/workbook.xml.rels": '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Id="r1" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/worksheet" '
    'Target="worksheets/sheet1.xml"/></Relationships>',
    "xl/worksheets/sheet1.xml": '<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><cols>'
    '<col min="4" max="9" hidden="1"/></cols><sheetData><row r="1"><c r="A1" t="inlineStr"><is><t>nm</t></is></c>'
    '<c r="B1" t="inlineStr"><is><t>R (%)</t></is></c></row>'
    + "".join(
        f'<row r="{row}"><c r="A{row}"><v>{380 + 10 * row}</v></c><c r="B{row}"><f>1+1</f><v>{row}.5</v></c></row>'
        for row in range(2, 8)
    )
    + '</sheetData><mergeCells count="1"><mergeCell ref="A9:A10"/></mergeCells></worksheet>',
}
SCATTERED = "# laboratory\n# sample\n3\n400 500 600\n" + "".join(
    f"{ti:.2f} 0 {to:.2f} {phi:.2f} 0.1 0.2 0.3\n"
    for ti in (0.1, 0.7, 1.2)
    for to in (0.1, 0.7, 1.2)
    for phi in (0.0, 1.5, 3.14)
)
FAMILY = """family = "paint"
kind = "analytic"
notes = "made up"

[[material]]
name = "grey"
model = "ashikhmin_shirley"
diffuse = { constant = 0.5 }
specular = { constant = 0.04 }
exponent_u = 25.0
exponent_v = 25.0
"""


def seeds() -> dict[str, dict[str, bytes]]:
    """Files by name, by the name of the module that reads them: of `spectral.formats`, then of `materials.formats`."""
    grey = SpectralEntry(
        "grey",
        Spectrum.sampled(NM, np.linspace(0.2, 0.6, NM.size)),
        (StatedColour("XYZ", np.array([40.0, 41.0, 42.0]), "D50", "1931_2"),),
        {"geometry": "45:0", "condition": "M1"},
    )
    lamp = SpectralEntry("lamp", Spectrum.sampled(NM, np.linspace(0.2, 6.0, NM.size), "emission"))
    wide = SpectralEntry("odd", Spectrum.sampled([401.5, 433.0, 702.25], [0.5, 0.25, 0.75]))
    spectral = {"S0.%d,000000nm": 0.4, "T.%d,000000nm": 0.7}
    pictures = {
        kind: {kind % nm: np.full((3, 4), value) + 0.01 * np.arange(12).reshape(3, 4) for nm in range(400, 701, 50)}
        for kind, value in spectral.items()
    }
    attributes = {"spectralLayoutVersion": "1.0", "emissiveUnits": "W.m^-2.sr^-1.nm^-1"}
    bands = range(400, 601, 50)
    shifted = {f"T.{i},0nm.{o},0nm": np.full((1, 2), 0.01) for i in bands for o in bands if i < o}
    diagonal = {f"T.{nm},0nm": np.full((1, 2), 0.5) for nm in bands}
    charts = {
        "reflective.exr": _written(write_exr, attributes, pictures["T.%d,000000nm"]),
        "emissive.exr": _written(write_exr, attributes, pictures["S0.%d,000000nm"]),
    }
    return {
        "cxf": {"a.cxf": _written(write_cxf, [grey, wide]), "b.cxf": _written(write_cxf, [lamp])},
        "iestm27": {"a.spdx": TM27.encode()},
        "qtx": {"a.qtx": SHADES.encode()},
        "jcamp": {"a.jdx": PACKED.encode()},
        "xlsx": {"a.xlsx": _book()},
        "cgats": {"a.txt": CHART.encode(), "a.sp": LAMP.encode(), "a.ccss": LAMP.replace("SPECT\n", "CCSS\n").encode()},
        "instrument_text": {"meter.txt": METER.encode(), "across.csv": TABLE_ACROSS.encode()},
        "spd": {"a.spd": b"# power\n400 1.0\n410 2.0\n420 1.5\n"},
        "csv": {
            "a.csv": _written(write_csv, [grey]),
            "b.csv": TABLE_ACROSS.encode("cp1252"),
            "c.tsv": METER.encode("utf-16"),
        },
        "mat": {"a.mat": _mat()},
        "spectral_exr": charts,
        "family": {"paint.toml": FAMILY.encode()},
        "merl": {"a.binary": _merl()},
        "rgl": {"a.bsdf": _written(write_tensors, _tensors())},
        "cornell": {"a.brdf": SCATTERED.encode()},
        "btf": {
            f"tl000 pl000 tv000 pv000.{kind}": content
            for kind, content in (
                ("png", _picture("PNG")),
                ("jpg", _picture("JPEG")),
                ("exr", charts["reflective.exr"]),
            )
        },
        "bispectral": {"a.exr": _written(write_exr, attributes, shifted | diagonal)},
        "texture_exr": charts,
        "gltf": {"a.gltf": json.dumps(_gltf()).encode(), "b.glb": _glb()},
        "maps": {"wood_albedo.png": _picture("PNG"), "wood_albedo.jpg": _picture("JPEG")},
        "unreadable": {"a.axf": b"\x89HDF\r\n\x1a\n" + b"com.xrite.Materials" + bytes(200), "a.mtlx": b"<materialx/>"},
    }


def _written(write: Callable[..., None], *arguments: object) -> bytes:
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        path = Path(folder) / "file"
        write(path, *arguments)
        return path.read_bytes()


def _book() -> bytes:
    """A workbook of one sheet, its parts as they are: damage reaches them."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, text in BOOK.items():
            archive.writestr(zipfile.ZipInfo(name), text)
    return packed.getvalue()


def _mat() -> bytes:
    from scipy.io import savemat

    file = io.BytesIO()
    savemat(file, {"wavelength": NM[:, None], "reflectance": np.linspace(0.1, 0.6, 3 * NM.size).reshape(NM.size, 3)})
    return file.getvalue()


def _merl() -> bytes:
    values = np.full((3, *SHAPE), 0.3)
    values[:, 60:, 60:] = -1.0
    return np.array(SHAPE, "<i4").tobytes() + values.tobytes()


def _tensors() -> Mapping[str, np.ndarray]:
    random = np.random.default_rng(0)
    theta_i = np.radians([0, 30, 55, 75, 90]).astype(np.float32)

    def positive(*shape: int) -> np.ndarray:
        return (0.2 + random.random(shape)).astype(np.float32)

    return {
        "description": np.frombuffer(b"a fuzz test", np.uint8),
        "phi_i": np.zeros(1, np.float32),
        "theta_i": theta_i,
        "ndf": np.repeat(positive(1, 12), 9, axis=0),
        "sigma": np.repeat(positive(1, 8), 7, axis=0),
        "vndf": positive(1, 5, 9, 12),
        "luminance": positive(1, 5, 6, 6),
        "jacobian": np.ones(1, np.uint8),
        "rgb": positive(1, 5, 3, 6, 6),
    }


def _picture(form: str) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    values = np.random.default_rng(0).integers(30, 220, (8, 8, 3)).astype(np.uint8)
    Image.fromarray(values).save(file, form)
    return file.getvalue()


def _gltf() -> dict:
    metallic = {"baseColorFactor": [0.8, 0.2, 0.1, 1.0], "metallicFactor": 0.5, "roughnessFactor": 0.4}
    return {
        "asset": {"version": "2.0", "generator": "a fuzz test"},
        "materials": [
            {"name": "paint", "pbrMetallicRoughness": metallic, "emissiveFactor": [0.0, 0.1, 0.0]},
            {"name": "glass", "extensions": {"KHR_materials_ior": {"ior": 1.5}}, "alphaMode": "BLEND"},
        ],
    }


def _glb() -> bytes:
    picture = _picture("PNG")
    made = _gltf() | {
        "textures": [{"source": 0}],
        "images": [{"bufferView": 0, "mimeType": "image/png"}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": len(picture)}],
        "buffers": [{"byteLength": len(picture)}],
    }
    made["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    text = json.dumps(made).encode()
    text += b" " * (-len(text) % 4)
    picture += b"\0" * (-len(picture) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(picture), b"BIN\0") + picture
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
