"""Measured surfaces for the benchmark of factorisation, found in a folder of data by what its files are."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from ...materials.core.brdf import Brdf
from ...materials.formats import bispectral
from ...materials.intake.sources import read_sources
from ...materials.records.models import rebuild
from ...materials.records.source import Rejected
from ...runtime.errors import InputError
from ...runtime.private_folder import private_folder
from .case import Case

# Name, title, budget at p99, packs of the paper: figure 5 of Schwenk 2010 and two sharper ones.
_MERL = (
    ("red-fabric", "Red fabric, MERL", 1.0, 8),
    ("blue-metallic-paint", "Blue metallic paint, MERL", 1.0, 24),
    ("yellow-matte-plastic", "Yellow matte plastic, MERL", 1.0, 22),
    ("specular-blue-phenolic", "Specular blue phenolic, MERL", 1.5, None),
    ("chrome-steel", "Chrome steel, MERL", 1.5, None),
)
# Effect paints, lacquers and vinyls: the budget that a picture of them is taken for.
_BUDGET = 1.0
#: Folders where `measured_cases` looks.
PLACES = ("brdf/merl", "brdf/merl-fits", "brdf/cornell-spectral", "brdf/rgl", "spectra/exr")


def measured_cases(data: Path) -> tuple[Case, ...]:
    """Return every measured surface in `data`, by family and name; a file is read when its case is made.

    A MERL material is a file `brdf/merl/NAME.binary`, or one that `brdf/merl-fits/write_binary.py NAME OUT` writes.
    Then each `brdf/cornell-spectral/*.brdf`, each `brdf/rgl/*.bsdf`, and the surfaces of each bispectral
    `spectra/exr/*.exr`.
    """
    brdf = data / "brdf"
    return (
        *_merl_cases(brdf),
        *_files(brdf / "cornell-spectral", "*.brdf", "measured at scattered directions"),
        *_files(brdf / "rgl", "*.bsdf", "RGL"),
        *_bispectral_cases(data / "spectra" / "exr"),
    )


def _merl_cases(brdf: Path) -> Iterator[Case]:
    script = brdf / "merl-fits" / "write_binary.py"
    files = {file.stem: file for file in sorted((brdf / "merl").glob("*.binary"))}
    for name, title, budget, packs in _MERL:
        if name in files:
            yield Case(name, title, budget, packs, partial(material_of_file, files.pop(name)))
        elif script.exists():
            yield Case(name, title, budget, packs, partial(written_surface, script, name))
    for name, file in files.items():
        yield Case(name, f"{_words(file)}, MERL", _BUDGET, None, partial(material_of_file, file))


def _files(folder: Path, pattern: str, family: str) -> Iterator[Case]:
    for file in sorted(folder.glob(pattern)):
        yield Case(file.stem, f"{_words(file)}, {family}", _BUDGET, None, partial(material_of_file, file))


def _bispectral_cases(folder: Path) -> Iterator[Case]:
    """One case a surface. How many there are is known only when the picture is read, so that it is read here."""
    for file in sorted(folder.glob("*.exr")):
        with file.open("rb") as stream:
            head = stream.read(4096)
        if not bispectral.recognises(file, head):
            continue
        surfaces = bispectral.read_bispectral(file)
        for number, surface in enumerate(surfaces, 1):
            title = f"Fluorescent surface {number} of {len(surfaces)}, {file.name}"
            yield Case(f"{file.stem}-{number}", title, _BUDGET, None, lambda surface=surface: surface)


def _words(file: Path) -> str:
    """Return the name of a file for people: `garnet_red` becomes `Garnet red`."""
    words = file.stem.replace("_", " ").replace("-", " ")
    return words[:1].upper() + words[1:]


def material_of_file(file: Path) -> Brdf:
    """Return the one material of a file, as an import has it; raises `InputError` where it holds none."""
    (found,) = read_sources(file)
    if isinstance(found, Rejected):
        raise found.reason
    surface = rebuild(found.model, found.parameters)
    assert isinstance(surface, Brdf)
    return surface


def written_surface(script: Path, name: str) -> Brdf:
    """Return the table that a script beside the data writes, 33 MB, read and let go; raises `InputError` where it does
    not.
    """
    with private_folder() as folder:
        out = folder / f"{name}.binary"
        done = subprocess.run([sys.executable, script, name, out], capture_output=True, text=True)
        if done.returncode != 0:
            raise InputError(
                "the table was not written",
                file=script,
                field=name,
                found=done.stderr.strip()[-200:],
                hint=f"see what `python {script} {name} out.binary` says",
            )
        return material_of_file(out)
