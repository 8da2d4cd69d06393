"""What the tests of lighting share."""

import warnings

import pytest


@pytest.fixture(scope="module")
def mi():
    """Mitsuba 3 with spectra, or a skip that says what is missing."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mitsuba = pytest.importorskip("mitsuba", reason="needs the mitsuba extra: pip install 'metamer[mitsuba]'")
        if "scalar_spectral" not in mitsuba.variants():
            pytest.skip("this Mitsuba has no scalar_spectral variant")
        mitsuba.set_variant("scalar_spectral")
    return mitsuba
