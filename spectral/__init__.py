"""Colour science: wavelengths, bases, spectra, observers, illuminants, adaptation and colour differences.

Begin with `basis.py`, small linear spectral bases, `spectrum.py` and `observers.py`; `palette.py` and `folding.py`
combine a surface's spectra with light and observer. `formats/` reads files of spectra.
"""
