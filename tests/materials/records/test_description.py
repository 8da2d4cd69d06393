"""Description of a record, as pages and terminals show it."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.materials.analytic import AshikhminShirley
from metamer.materials.core.fit_error import FitError
from metamer.materials.export.spectrum import exported_spectrum
from metamer.materials.fitting.fit import Trial
from metamer.materials.records.description import shown_colours, shown_spectrum, shown_trials
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.runtime.errors import InputError
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM


def brushed(**changes):
    brdf = AshikhminShirley.examples(WORKING_WAVELENGTHS_NM)[2]
    assert not brdf.isotropic
    parameters = {**brdf.parameters(), "wavelengths_nm": brdf.wavelengths_nm}
    record = MaterialRecord("x/b", "x", brdf.NAME, parameters, Provenance("a", "b", "analytic"), None)
    return replace(record, **changes)


def test_an_anisotropic_surface_is_shown_as_it_is_exported():
    shown = shown_spectrum(brushed())
    np.testing.assert_array_equal(shown.values, exported_spectrum(brushed()).spectrum.samples)


def test_trials_are_words_and_what_is_missing_is_empty():
    error = FitError(0.5, float("nan"), 1.25, float("inf"), "D65", "1931_2", "sphere", 0.0)
    headings, rows = shown_trials(brushed(trials=(Trial(1, "hd", 3, 0.0, error, 1.25, True, joint=False),)))
    row = dict(zip(headings, *rows, strict=True))
    assert row["lobe"] == "2" and row["frame"] == "hd" and row["rank"] == "3"
    assert (row["mean"], row["p95"], row["p99"], row["maximum"]) == ("0.500", "", "1.250", "inf")
    assert (row["kept"], row["joint"]) == ("yes", "no") and "seconds" not in row


def test_stated_colours_say_what_was_assumed():
    stated = {
        "wavelengths_nm": WORKING_WAVELENGTHS_NM,
        "values": np.full(81, 0.2),
        "quantity": "reflectance",
        "stated.0.space": "Lab",
        "stated.0.values": np.array([51.837, 0.0, -0.001]),
    }
    (found,) = shown_colours(brushed(original=stated))
    assert (found.conditions, found.space, found.stated) == ("D50, 1931_2", "Lab", "51.84 0.00 -0.00")
    assert found.recomputed.startswith("51.84 ") and found.delta_e94 == "0.00" and len(found.assumed) == 2
    with pytest.raises(InputError, match="unknown illuminant"):
        shown_colours(brushed(original=stated | {"stated.0.illuminant": "my lamp"}))
