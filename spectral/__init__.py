"""Colour science: wavelengths, bases, spectra, observers, illuminants, adaptation and colour differences.

Begin with `basis.py`, the small linear bases that everything carries, `spectrum.py` and `observers.py`; `palette.py`
and `folding.py` are where a surface's spectra meet light and observer. `formats/` reads files of spectra.
"""
