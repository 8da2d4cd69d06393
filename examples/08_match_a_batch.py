"""Does a batch match its master? Differences, a tolerance, the instrument's uncertainty, and metamerism."""

from pathlib import Path

import numpy as np
from metamer import Spectrum, illuminant, match, observer
from metamer.spectral.formats.csv import read_csv_spectra
from metamer.spectral.sample import Sample
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

CHIPS = Path(__file__).parent.parent / "catalogs" / "shipped" / "spectra" / "munsell_nist_cqs9.csv"


def reading(name: str, values: np.ndarray) -> Sample:
    return Sample(name, "made up for this example", (Spectrum.sampled(NM, values),))


def main() -> None:
    paint = read_csv_spectra(CHIPS)["2-5g-6-12"].resampled(NM).samples
    # The part of a ripple invisible under D65: another pigment that gives the same colour in daylight.
    seen = observer("1964_10").weights(illuminant("D65"), NM)
    ripple = 0.035 * np.cos(2 * np.pi * (NM - 380) / 130)
    ripple = ripple - seen.T @ np.linalg.solve(seen @ seen.T, seen @ ripple)
    lots = [
        reading("lighter", 1.02 * paint),
        reading("at the limit", 1.036 * paint),
        reading("other pigment", paint + ripple),
    ]

    report = match(reading("master", paint), lots, "CIE 2000 0.8", illuminants=("D65", "A"), repeatability=0.05)
    for one in report.samples:
        print(f"{one.sample.name}: {one.verdict}")
        for found in one.differences:
            delta_e, known = found.delta_e["CIE 2000"], found.spread
            about = f" ± {known.delta_e['CIE 2000']:.2f}" if known else ""
            print(f"  {found.conditions.words}: ΔE2000 {delta_e:.2f}{about}, {found.words}")
        for index in one.indices:
            if index.name.startswith("metamerism"):
                print(f"  {index.name}: {index.value:.2f}")
    Path("match.html").write_text(report.html(), encoding="utf-8")
    print(f"All together: {report.verdict}. The page to sign: match.html")


if __name__ == "__main__":
    main()
