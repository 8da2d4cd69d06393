"""Formats that are not read are named, with what to export instead."""

import zipfile

import pytest
from metamer.materials.formats import unreadable
from metamer.materials.intake.sources import read_sources
from metamer.runtime.errors import InputError
from metamer.spectral.formats.registry import read_spectra

SAMPLES = {
    "paint.axf": (b"\x89HDF\r\n\x1a\n" + b"\0" * 50, "X-Rite AxF", "PANTORA"),
    "paint.bin": (b"\x89HDF\r\n\x1a\n" + b"\0" * 500 + b"com.xrite.Materials\0", "X-Rite AxF", "CxF3"),
    "a.h5": (b'{"format":"metamer-material","schema":2}\n', "a material of a catalogue", "catalogue list"),
    "ink.mif": (b"\r\n[FILE INFO]\r\nVERSION=2000\r\n", "X-Rite MIF, of Ink Master or PantoneLIVE", "CxF3"),
    "a.mesx": (b"\x01\x02", "a Konica Minolta SpectraMagic document", "CSV"),
    "brand.ase": (b"ASEF\0\1\0\0", "colour swatches", "measure"),
    "press.icc": (b"\0" * 36 + b"acsp", "an ICC profile", "CGATS"),
    "wood.sbsar": (b"7z\xbc\xaf\x27\x1c", "Adobe Substance", "glTF"),
    "any.xml": (b'<?xml version="1.0"?>\n<materialx version="1.38">', "MaterialX", "glTF"),
    "paint.mdl": (b"// flakes\nmdl 1.7;\n", "NVIDIA MDL", "RGL"),
    "chrome.kmp": (b"PK\3\4", "KeyShot", "glTF"),
    "a.usdc": (b"PXR-USDC\0", "OpenUSD", "glTF"),
    "a.blend": (b"BLENDER-v300", "a scene of a modelling program", "glTF"),
    "cloth.btf": (b"!6FB\1\0", "a bidirectional texture (BTF)", "RGL"),
    "pane.xml": (b"<?xml version='1.0'?><WindowElement xmlns=''>", "a BSDF of a window (WINDOW, Radiance)", "CSV"),
    "readings.xls": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an Excel 97 workbook", "xlsx"),
    "of no name": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an Excel 97 workbook", "xlsx"),
    "old.XLS": (b"\x09\x08\x08\x00\x00\x05", "a workbook of Excel 5 or older", "xlsx"),
    "page.xls": (b"\r\n<html><table><tr><td>nm", "a web page that is named as a workbook", "xlsx"),
    "sheet.xml": (
        b'<?xml version="1.0"?>\n<?mso-application progid="Excel.Sheet"?>\n<Workbook>',
        "an Excel 2003 workbook in XML",
        "xlsx",
    ),
    "sheet": (
        b"PK\3\4" + b"\0" * 26 + b"mimetypeapplication/vnd.oasis.opendocument.spreadsheet",
        "an OpenDocument spreadsheet",
        "CSV",
    ),
    "paint.spc": (b"\x00\x4b\x00\x00", "Galactic SPC", "GRAMS"),
    "field.000": (b"as7" + b"\0" * 200, "a binary file of an ASD spectrometer", "ViewSpec"),
    "field.asd": (b"ASDa comment".ljust(160, b"\0"), "a binary file of an ASD spectrometer", "ViewSpec"),
    "a.ProcSpec": (b"PK\3\4", "Ocean Optics ProcSpec", "tab-delimited"),
    "Johnson.yml": (
        b"REFERENCES: x\nDATA:\n  - type: tabulated nk\n    data: |\n        0.36 1.0 0.1\n",
        "optical constants (refractiveindex.info)",
        "family",
    ),
    "set.7z": (b"7z\xbc\xaf\x27\x1c\0\4", "a packed archive", "unpack"),
}


@pytest.mark.parametrize(("name", "sample"), SAMPLES.items(), ids=SAMPLES)
def test_formats_that_are_not_read_are_named(tmp_path, name, sample):
    head, called, hint = sample
    path = tmp_path / name
    path.write_bytes(head)
    assert unreadable.recognises(path, head) and unreadable.label(path) == called
    with pytest.raises(InputError) as caught:
        list(unreadable.read_sources(path, "mallett-yuksel"))
    said = caught.value
    assert said.file == path and said.field and said.found == called and said.expected and hint in said.hint


_TENSOR = b"tensor_file\0\1\0\x05\0\0\0"


@pytest.mark.parametrize(
    ("name", "head", "called"),
    [
        ("film.cube", b'TITLE "film"\nLUT_3D_SIZE 2\n0 0 0\n1 0 0\n0 1 0\n', "a colour look-up table"),
        ("look.txt", b"# made\nLUT_1D_SIZE 3\n0.1 0.1 0.1\n0.4 0.4 0.4\n0.7 0.7 0.7\n", "a colour look-up table"),
        ("grade.csp", b"CSPLUTV100\n3D\n\n2\n0.0 1.0\n0.0 1.0\n", "a colour look-up table"),
        ("a.spi3d", b"SPILUT 1.0\n3 3\n2 2 2\n0 0 0 0.1 0.1 0.1\n", "a colour look-up table"),
        ("spot.ies", b"IESNA:LM-63-2002\n[TEST] 1\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n", "a photometric file"),
        ("gold.bsdf", _TENSOR + b"\1\0M" + bytes(60) + b"\4\0wvls" + bytes(30) + b"\7\0theta_h", "a polarised BSDF"),
        ("sky.bin", _TENSOR + b"\4\0data\5\0\x0a" + bytes(80), "a tensor file of something else"),
    ],
)
def test_other_tables_of_numbers_are_called_what_they_are(tmp_path, name, head, called):
    path = tmp_path / name
    path.write_bytes(head)
    (refused,) = read_sources(path)
    assert called in str(refused.reason.found) and refused.reason.hint


@pytest.mark.parametrize(
    ("name", "head"),
    [
        ("a.csv", b"wavelength_nm,red\n"),
        ("photo.jpg", b"\xff\xd8\xff"),
        ("read.me", b"how to"),
        ("a.json", b"{}"),
        ("music.spc", b"SNES-SPC700 Sound File Data"),
        ("asd.txt", b"ASD spectrum file\n400\t0.1\n"),
        ("ci.yml", b"jobs:\n  - type: formula 1\n"),
        ("a.zip", b"PK\3\4"),
    ],
)
def test_what_is_nobody_s_stays_so(tmp_path, name, head):
    path = tmp_path / name
    path.write_bytes(head)
    assert not unreadable.recognises(path, head)
    with pytest.raises(InputError, match="not a format of materials") as caught:
        unreadable.refuse(path, head)
    assert "glTF" in caught.value.hint


@pytest.mark.parametrize(
    ("member", "called"),
    [
        ("xl/workbook.bin", "a binary Excel workbook (.xlsb)"),
        ("OOISignatures.xml", "Ocean Optics ProcSpec"),
    ],
)
def test_containers_are_known_by_what_is_in_them(tmp_path, member, called):
    path = tmp_path / "of another name"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("[Content_Types].xml", "<x/>" * 2000)
        archive.writestr(member, "<x/>")
    assert unreadable.label(path) == called


def test_a_scene_beside_its_maps_is_no_failure(tmp_path):
    """Libraries pack maps together with scenes that use them: the maps say it all."""
    scene = tmp_path / "bricks.mtlx"
    scene.write_bytes(b"<materialx >")
    assert unreadable.recognises(scene, b"<materialx >")
    (tmp_path / "bricks_Color.png").write_bytes(b"")
    assert not unreadable.recognises(scene, b"<materialx >")


def test_real_files_are_nobody_s_mistake(shared_data):
    """What is read elsewhere is not claimed here."""
    for path in sorted(shared_data.rglob("*")):
        if path.is_file() and path.suffix not in (".md", ".py"):
            with path.open("rb") as file:
                assert not unreadable.recognises(path, file.read(4096)), path


MESHES = {
    "a.obj": "# a cube\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1 2 3\n",
    "like_a_table.OBJ": "v 400 0.1 0\nv 410 0.2 0\nv 420 0.3 0\nv 430 0.3 0\nf 1 2 3\n",
    "a.ply": "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nend_header\n0\n1\n2\n",
    "a.off": "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "a.stl": "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n",
    "b.stl": "\0" * 134,
}


@pytest.mark.parametrize("name", MESHES)
def test_a_mesh_that_is_named_is_told_where_it_goes(tmp_path, name):
    path = tmp_path / name
    path.write_text(MESHES[name])
    with pytest.raises(InputError, match="a mesh, not a material") as caught:
        read_sources(path)
    assert f'mesh = "{name}"' in str(caught.value) and "metamer render" in str(caught.value)


def test_meshes_in_a_folder_are_passed_over(tmp_path):
    for name, text in MESHES.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "red.csv").write_text("nm,reflectance (%)\n400,10\n500,20\n600,30\n700,40\n")
    assert [found.id for found in read_sources(tmp_path)] == ["red/red"]


@pytest.mark.parametrize("name", [name for name, (_, called, _) in SAMPLES.items() if "workbook" in called])
def test_workbooks_are_named_wherever_spectra_are_read(tmp_path, name):
    """Commands that read spectra and no materials say it, too."""
    head, called, _ = SAMPLES[name]
    path = tmp_path / name
    path.write_bytes(head)
    with pytest.raises(InputError, match="not read") as caught:
        read_spectra(path)
    assert caught.value.found == called and "save it as .xlsx" in caught.value.hint
