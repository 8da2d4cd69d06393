"""`metamer catalogue verify` of BTFs: the error of texels is measured again, and images that are gone are counted."""

import json
import os
import time
from dataclasses import replace

import numpy as np
import pytest
from btf_sets import NINE, written
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.intake.importing import import_sources
from metamer.materials.records.record import material_path, write_record
from metamer.materials.records.verification import check_decodes
from metamer.runtime.errors import InputError
from metamer.spectral.formats.import_options import ImportOptions

SOME = NINE[:4]


@pytest.fixture
def wool(tmp_path):
    folder = tmp_path / "wool"
    written(folder, SOME, SOME)
    for path in [*folder.rglob("*"), folder]:
        os.utime(path, (time.time() - 3600,) * 2)
    said = ImportOptions(encoding="srgb", white=(1.0,), btf_form="rfp")
    report = import_sources([folder], tmp_path / "cat", jobs=1, answer=said)
    assert report.count("imported") == 1, report.outcomes
    return folder


@pytest.mark.slow
def test_the_error_of_texels_is_measured_again_and_a_wrong_one_is_damage(wool, metamer):
    cat = wool.parent / "cat"
    code, out, _ = metamer("catalogue", "verify", cat, "--jobs", 1, "--json", "-")
    texels = json.loads(out)["materials"][0]["texels"]
    assert code == 0 and texels["measured"] == pytest.approx(texels["declared"], abs=0.01)
    assert texels["declared"]["mean"] > 0.05
    record = Catalogue.open(cat).load("btf/wool")
    said = record.fast.texel_error
    lights = tuple(replace(one, mean=one.mean + 0.05) for one in said.lights)
    wrong = replace(record.fast, texel_error=replace(said, mean=said.mean + 0.05, lights=lights))
    write_record(replace(record, fast=wrong), material_path(cat, record.id))
    code, out, _ = metamer("catalogue", "verify", cat, "--jobs", 1)
    assert code == 4 and "the declared error does not hold" in out and "texel_error" in out, out


def test_images_that_are_gone_are_counted_and_the_form_is_looked_at(wool, metamer):
    for path in sorted(wool.glob("*.png"))[:3]:
        path.unlink()
    code, out, _ = metamer("catalogue", "verify", wool.parent / "cat", "--jobs", 1)
    assert code == 1 and f"3 of 16 images are gone that were left in {wool}" in out, out


def test_a_form_that_decodes_to_no_numbers_is_damage(wool):
    record = Catalogue.open(wool.parent / "cat").load("btf/wool")
    check_decodes(record)
    form = record.fast.texels.form
    steps = {
        name: np.full_like(value, np.nan)
        for name, value in vars(form).items()
        if isinstance(value, np.ndarray) and value.dtype.kind == "f"
    }
    broken = replace(record.fast, texels=replace(record.fast.texels, form=replace(form, **steps)))
    with pytest.raises(InputError, match="not finite"):
        check_decodes(replace(record, fast=broken))
