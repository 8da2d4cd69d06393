"""BTFs written as images, and read again."""

import numpy as np
import pytest
from btf_sets import NINE, written
from metamer.materials.btf import form
from metamer.materials.btf.hemisphere import Hemisphere
from metamer.materials.btf.images import HeldImages
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.export.files import export
from metamer.materials.formats.btf import read_sources
from metamer.materials.formats.btf_names import directions_of
from metamer.materials.formats.btf_writer import ABOUT, write_btf
from metamer.materials.intake.importing import import_sources
from metamer.materials.svbrdf.texture_form import texture_form
from metamer.runtime.errors import InputError
from metamer.spectral.basis import SpectralBasis
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

SOME = [*NINE[:4], (37.5, 212.25)]
AGAIN = ImportOptions(encoding="linear", white=(1.0,), includes_cosine=True)


@pytest.fixture
def catalogue(tmp_path, monkeypatch):
    """A set of 8 bits in a catalogue, with a fast form at once."""
    matt = texture_form(NM, np.full((1, 1, 81), 0.3))
    monkeypatch.setattr(form, "btf_form", lambda images, budget: matt)
    written(tmp_path / "wool", NINE[:5], NINE[:5], size=(3, 5))
    answer = ImportOptions(encoding="srgb", white=(0.9,), texel_mm=0.25)
    assert import_sources([tmp_path / "wool"], tmp_path / "cat", jobs=1, answer=answer).count("imported") == 1
    return Catalogue.open(tmp_path / "cat")


def read(folder, answer=AGAIN):
    (source,) = read_sources(next(iter(sorted(folder.glob("*.exr")))), "mallett-yuksel", answer)
    from metamer.materials.btf.surface import MeasuredBtf

    return MeasuredBtf.from_parameters(source.parameters).images


def seen(images):
    to_xyz = images.basis.fold(illuminant("D65"), observer("1931_2")).T
    pairs = [(v, i) for v in range(len(images.views)) for i in range(len(images.lights))]
    return np.stack([np.pi * images.image(*pair) @ to_xyz for pair in pairs])


def test_what_was_measured_comes_back(catalogue, tmp_path):
    heard = []
    (done,) = export(
        [catalogue.load("btf/wool")], "ubo", tmp_path / "out", progress=lambda n, of: heard.append((n, of))
    )
    names = sorted(path.name for path in done.path.iterdir())
    assert len(names) == 26 and names[0] == "00001 tl000 pl000 tv000 pv000.exr" and names[-1] == ABOUT
    assert heard == [(n, 25) for n in range(1, 26)]
    before, after = catalogue.load("btf/wool").surface().images, read(tmp_path / "out")
    white = observer("1931_2").white(illuminant("D65"))
    # float32, and the rounding of the uplift's table.
    assert delta_e_xyz(seen(before), seen(after), white).max() < 0.01


@pytest.mark.slow
def test_how_to_read_it_again_is_said_and_true(catalogue, tmp_path):
    export([catalogue.load("btf/wool")], "ubo", tmp_path / "out")
    said = (tmp_path / "out" / ABOUT).read_text()
    assert "--encoding linear --white 1 --includes-cosine yes --texel-mm 0.25" in said
    assert "btf/wool: source" in said
    from metamer.cli.main import main

    words = said.split("to read them again: ")[1].splitlines()[0].split()[1:]
    words[words.index("FOLDER")] = str(tmp_path / "out")
    assert main([*words, "--into", str(tmp_path / "again"), "--jobs", "1"]) == 0
    assert float(Catalogue.open(tmp_path / "again").load("btf/out").parameters["texel_mm"]) == 0.25


def test_wavelengths_and_odd_directions_are_kept(tmp_path):
    rng = np.random.default_rng(0)
    grid = np.array([420.0, 500.5, 610.0, 700.0])
    both = Hemisphere(directions_of(SOME))
    values = rng.uniform(0.01, 0.2, (5, 5, 2, 3, 4)).astype(np.float32)
    images = HeldImages(both, both, values, SpectralBasis.sampled(grid))
    write_btf(tmp_path, images, True, [])
    found = read(tmp_path, ImportOptions(includes_cosine=True))
    np.testing.assert_allclose(found.basis.wavelengths_nm, grid)
    for view, light in ((0, 0), (4, 2), (3, 4)):
        # Files are read in the order of their angles.
        v = int(np.argmax(found.views.directions @ both.directions[view]))
        i = int(np.argmax(found.lights.directions @ both.directions[light]))
        np.testing.assert_allclose(found.image(v, i), values[view, light], rtol=1e-5)
    np.testing.assert_allclose(np.sort(found.views.directions @ both.directions.T, axis=0)[-1], 1.0, atol=1e-9)


def test_originals_that_are_gone_are_said(catalogue, tmp_path):
    for path in (tmp_path / "wool").glob("*.png"):
        path.unlink()
    with pytest.raises(InputError, match="btf/wool"):
        export([catalogue.load("btf/wool")], "ubo", tmp_path / "out")
    assert not (tmp_path / "out").exists()
