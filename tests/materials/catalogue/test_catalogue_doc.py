"""Examples of docs/catalogue.md: what it tells others to type works, and its table of the file is the file."""

import re
from pathlib import Path

import h5py
import numpy as np
import pytest
from metamer.materials.records.record_head import SCHEMA, read_head

TEXT = (Path(__file__).resolve().parents[3] / "docs" / "catalogue.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, re.S)


def block(holding):
    (found,) = [text for text in BLOCKS if holding in text]
    return found


@pytest.fixture
def material(tmp_path, monkeypatch, write_matt):
    monkeypatch.chdir(tmp_path)
    original = {"values": np.linspace(0.0, 1.0, 1100), "details.instrument": "x"}
    return write_matt(tmp_path / "metamer-catalogue", "paint/red", original=original)


def test_five_lines_of_h5py(material, capsys):
    text = block("packs/0")
    text = text.replace("colorchecker/red-gloss", "paint/red").replace("theta_i", "theta_h")
    assert len([line for line in text.splitlines() if not line.startswith("import")]) == 5
    found = {}
    exec(text, found)
    assert found["factor"].shape == (len(found["angles"]), len(found["spectra"]))
    assert "'source': 'a test'" in capsys.readouterr().out


def test_the_text_of_a_matt_spectrum(tmp_path, monkeypatch, write_matt):
    monkeypatch.chdir(tmp_path)
    original = {"wavelengths_nm": [400.0, 700.0], "values": [0.25, 0.75]}
    write_matt(tmp_path / "metamer-catalogue", "chips/red", original=original)
    found = {}
    exec(block('"packed"'), found)
    assert (found["wavelengths_nm"], found["values"]) == ([400.0, 700.0], [0.25, 0.75])


def test_python_api(material, capsys):
    exec(block("compare_catalogues"), {})
    assert "paint/red" in capsys.readouterr().out


@pytest.mark.slow
def test_a_contact_sheet_from_python(material):
    exec(block("contact_sheet").replace("renderer, 128", "renderer, 16"), {})
    assert (material.parents[2] / "paints.png").read_bytes().startswith(b"\x89PNG")


def test_table_of_the_file_is_the_file(material):
    section = TEXT[TEXT.index("### Schema") :]
    assert section.startswith(f"### Schema {SCHEMA}\n")
    with h5py.File(material) as file:
        groups = set(file)
        names = {"/": set(file.attrs), "/error": set(file["error"].attrs), "/provenance": set(file["provenance"].attrs)}
        axis = file["packs/0/axes/theta_h"]
        names["/packs/0"] = set(file["packs/0"].attrs) | set(file["packs/0"]) - {"axes"}
        names["/packs/0/axes"] = set(axis.attrs) | set(axis)
    for group in groups:
        assert f"| `/{group}" in section, group
    for place, expected in names.items():
        row = next(line for line in section.splitlines() if line.startswith(f"| `{place}`") or f"`{place}/" in line)
        for name in expected:
            assert f"`{name}`" in row, (place, name)
    head = section[section.index("The head holds") :]
    for name in read_head(material).keys() - {"format", "schema"}:
        assert f"`{name}`" in head, name
