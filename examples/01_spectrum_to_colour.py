"""Colours from a reflectance, and two reflectances that are one colour in one light only: metamerism.

A colour is a spectrum seen by an observer under a light. The pair is a true one: to a green paint is added a metameric
black, a spectrum that has no colour under D65.
"""

from pathlib import Path

import numpy as np
from metamer import illuminant, observer
from metamer.spectral.difference import delta_e_xyz, lab_from_xyz
from metamer.spectral.formats.csv import read_csv_spectra
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

CHIPS = Path(__file__).parent.parent / "catalogs" / "shipped" / "spectra" / "munsell_nist_cqs9.csv"
LIGHTS = ("D65", "A", "FL11")


def main() -> None:
    paint = read_csv_spectra(CHIPS)["2-5g-6-12"].resampled(NM).samples

    print("Munsell 2.5G 6/12, CIELAB relative to the white of each light")
    for eye in ("1931_2", "1964_10", "2015_2"):
        for light in LIGHTS:
            weights = observer(eye).weights(illuminant(light), NM)
            lightness, a, b = lab_from_xyz(weights @ paint, weights.sum(axis=1))
            print(f"  {eye:8} {light:5} L* {lightness:6.2f}  a* {a:7.2f}  b* {b:6.2f}")

    # A ripple of the paint's own reflectance, less what D65 and the observer see of it. The sum stays a reflectance
    # where the ripple stays below 1.
    seen = observer("1931_2").weights(illuminant("D65"), NM) * paint
    ripple = np.cos(2 * np.pi * (NM - 380) / 130)
    ripple = ripple - np.linalg.pinv(seen) @ (seen @ ripple)
    match = paint * (1 + 0.6 * ripple / np.abs(ripple).max())

    print(f"\nIts match under D65 reflects {match.min():.3f} to {match.max():.3f}, up to", end=" ")
    print(f"{np.abs(match - paint).max():.3f} more or less than the paint")
    for light in LIGHTS:
        weights = observer("1931_2").weights(illuminant(light), NM)
        difference = delta_e_xyz(weights @ paint, weights @ match, weights.sum(axis=1))
        print(f"  1931_2 {light:5} ΔE94 {difference:.3f}")
    weights = observer("1964_10").weights(illuminant("D65"), NM)
    print(f"  1964_10 D65  ΔE94 {delta_e_xyz(weights @ paint, weights @ match, weights.sum(axis=1)):.3f}")


if __name__ == "__main__":
    main()
