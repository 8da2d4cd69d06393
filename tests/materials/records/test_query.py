"""Finding materials by the heads of their files."""

import json
import os
from dataclasses import replace

import numpy as np
import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.core.fit_error import FitError
from metamer.materials.records.material import Provenance
from metamer.materials.records.query import Query
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.difference import delta_e_lab


def off_by(p99):
    return FitError(p99 / 2, p99, p99, p99, "D65", "1931_2", "sphere", 0.0)


@pytest.fixture
def catalogue(tmp_path, write_matt, write_spectrum):
    write_matt(tmp_path, "paint/dark", 0.1, error=off_by(0.4))
    write_matt(tmp_path, "paint/light", 0.8, error=off_by(0.2))
    ramp = np.linspace(0.05, 0.9, 81)
    write_matt(tmp_path, "cloth/red", ramp, provenance=Provenance("a", "b", "uplifted(smits)"), error=None)
    write_spectrum(tmp_path, "lamp/led")
    write_spectrum(tmp_path, "glass/clear", "transmittance")
    return Catalogue.open(tmp_path)


def ids(found):
    return [one.id for one in found]


def test_everything_in_the_order_of_ids(catalogue):
    found = catalogue.query()
    assert ids(found) == ["cloth/red", "glass/clear", "lamp/led", "paint/dark", "paint/light"]
    dark = found[3]
    assert (dark.model, dark.kind, dark.terms, dark.precision) == ("lambert", "analytic", ((1, "hd"),), "single")
    assert (dark.p99, dark.light, dark.quantity, dark.rank) == (0.4, "D65", "reflectance", 1)
    assert dark.lab[0] == pytest.approx(116 * 0.1 ** (1 / 3) - 16, abs=1e-3)
    assert found[2].lab is None and found[2].xyz[1] == 1.0 and found[2].terms == ()


@pytest.mark.parametrize(
    ("query", "expected"),
    [
        (Query(families=("PAINT", "lamp")), ["lamp/led", "paint/dark", "paint/light"]),
        (Query(families="paint", models="lambert"), ["paint/dark", "paint/light"]),
        (Query(ids=("*/*d*",)), ["cloth/red", "lamp/led", "paint/dark"]),
        (Query(models=("lambert",)), ["cloth/red", "paint/dark", "paint/light"]),
        (Query(kinds=("uplifted",)), ["cloth/red"]),
        (Query(quantities=("emission", "trans*")), ["glass/clear", "lamp/led"]),
        (Query(max_error=0.3), ["paint/light"]),
        (Query(sort="error"), ["paint/light", "paint/dark", "cloth/red", "glass/clear", "lamp/led"]),
        (Query(sort="error", reverse=True, limit=2), ["paint/dark", "paint/light"]),
        (Query(sort="lightness", families=("paint",)), ["paint/dark", "paint/light"]),
        (Query(sort="chroma", reverse=True, limit=1), ["cloth/red"]),
        (Query(families=("paint",), models=("ggx",)), []),
    ],
)
def test_queries(catalogue, query, expected):
    assert ids(catalogue.query(query)) == expected


@pytest.mark.parametrize("formula", ["CIE 1994", "CIE 2000"])
def test_near_a_colour_that_is_the_reference(catalogue, formula):
    """CIE 1994 is not symmetric: a chromatic reference weighs its own chroma."""
    red = catalogue.summary("cloth/red")
    wanted = (red.lab[0] + 1.0, red.lab[1] + 4.0, red.lab[2])
    found = catalogue.query(Query(models=("lambert",), near=wanted, within=5.0, formula=formula))
    assert ids(found) == ["cloth/red"]
    expected = delta_e_lab(np.array(wanted), np.array(red.lab), formula)
    assert found[0].distance == pytest.approx(float(expected))
    others = catalogue.query(Query(near=wanted))
    assert ids(others)[0] == "cloth/red" and ids(others)[-1] == "lamp/led"
    assert catalogue.query(Query(near=wanted, within=0.1)) == ()


def test_numbers_in_ids_are_counted(tmp_path, write_spectrum):
    for name in ("x/10", "x/9", "x/a2", "x/a10", "x/a2-b"):
        write_spectrum(tmp_path, name)
    catalogue = Catalogue.open(tmp_path)
    assert ids(catalogue.query()) == ["x/9", "x/10", "x/a2", "x/a2-b", "x/a10"]
    assert ids(catalogue.query(Query(reverse=True, limit=1))) == ["x/a10"]


def test_questions_that_make_no_sense_are_refused():
    with pytest.raises(InputError, match="near: a distance from nowhere"):
        Query(within=3.0)
    with pytest.raises(UnknownNameError, match="nearest: lightness"):
        Query(sort="lightnes")
    with pytest.raises(InputError, match="limit"):
        Query(limit=-1)


def test_damaged_head_is_named_and_holds_nobody_up(catalogue):
    path = catalogue.path("paint/dark")
    path.write_bytes(b"{" + path.read_bytes()[1:4000])
    with pytest.raises(InputError, match=r"dark\.h5"):
        replaced = path.read_bytes().replace(b'"paint/dark"', b'"paint/bark"')
        path.write_bytes(replaced)
        catalogue.query()
    unusable = []
    assert len(catalogue.query(unusable=unusable)) == 4
    assert len(unusable) == 1 and "dark.h5" in str(unusable[0])


def test_head_without_a_field_is_damage(catalogue):
    path = catalogue.path("paint/dark")
    path.write_bytes(path.read_bytes().replace(b'"terms"', b'"torms"'))
    with pytest.raises(InputError, match=r"(?s)dark\.h5: the head of the file is damaged.*terms"):
        catalogue.query()


@pytest.mark.parametrize("value", [None, 7, "x", [], {}, [[1]], {"light": 3}, float("inf"), "[" * 3000])
def test_no_head_breaks_a_query(catalogue, value):
    """Whatever JSON stands there: a summary or an error that names the file."""
    path = catalogue.path("paint/dark")
    block, _, content = path.read_bytes().partition(b"\n")
    whole = json.loads(block)
    for name in whole:
        text = json.dumps({**whole, name: value}).encode()
        path.write_bytes(text.ljust(4096)[:4096] + content)
        unusable = []
        found = catalogue.query(Query(near=(1.0, 2.0, 3.0)), unusable)
        assert len(found) + len(unusable) == 5
        assert all("dark.h5" in str(reason) for reason in unusable)
        for one in found:
            assert isinstance(one.rank, int) and (one.p99 is None or isinstance(one.p99, float))
    path.write_bytes(b"[" * 4096 + content)
    with pytest.raises(InputError, match=r"dark\.h5"):
        catalogue.query()


def test_no_file_is_read_further_than_its_head(catalogue):
    for material_id in catalogue.ids():
        os.truncate(catalogue.path(material_id), 4096)
    assert len(catalogue.query()) == 5


def test_surfaces_leave_spectra_out(catalogue):
    assert catalogue.match_surfaces("*") == ("cloth/red", "paint/dark", "paint/light")
    with pytest.raises(InputError, match=r"(?s)lamp/led: an emission spectrum, not a surface.*use it as a light"):
        catalogue.match_surfaces("lamp/*")
    with pytest.raises(InputError, match=r"(?s)glass/clear: a transmittance spectrum.*measure"):
        catalogue.surface("glass/clear")
    assert catalogue.surface("paint/dark").summands


def test_ids_lead_nowhere_outside(catalogue, tmp_path):
    for wrong in ("../paint/dark", "paint/../paint/dark", "", "/etc/passwd", "paint//dark"):
        with pytest.raises(UnknownNameError):
            catalogue.path(wrong)


def test_summary_is_frozen(catalogue):
    one = catalogue.summary("paint/dark")
    assert replace(one, distance=1.0).distance == 1.0 and one.distance is None
