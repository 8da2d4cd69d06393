"""Size of a basis for spectra: the balanced basis against Peercy's, on the ColorChecker under fourteen lights.

Both are linear and of the same cost. Peercy's keeps the spectra; the balanced one keeps the colours.
"""

import numpy as np
from metamer.benchmarks.basis import LIGHTS, basis_error, stage
from metamer.spectral.basis import SpectralBasis

SIZES = (3, 4, 5, 6, 8, 10, 12)
BUDGET = 0.1  # ΔE94 for the worst patch under the worst light


def main() -> None:
    chart = stage()  # reflectances (24, 81); light x colour-matching functions (81, 3 lights)
    print(f"Largest ΔE94 over 24 patches and {len(LIGHTS)} lights, by the number J of coefficients")
    print("  J   balanced    Peercy")
    errors = {}
    for size in SIZES:
        balanced = SpectralBasis.balanced(chart.reflectances, chart.columns, size)
        peercy = SpectralBasis.peercy(chart.reflectances, chart.columns, size)
        errors[size] = basis_error(balanced, chart)
        print(f"{size:3}   {errors[size]:8.3f}  {basis_error(peercy, chart):8.3f}")

    enough = min(size for size, error in errors.items() if error <= BUDGET)
    print(f"Smallest balanced basis within {BUDGET}: J = {enough}, in place of 81 samples")

    # With a single light three numbers are the whole truth: they are its XYZ in other coordinates.
    single = chart.under(["FL11"])
    exact = SpectralBasis.balanced(single.reflectances, single.columns)
    print(f"One light alone: J = {exact.size}, largest ΔE94 {basis_error(exact, single):.1e}")

    # A surface is projected once, a light is folded once; their product is the colour.
    patch = chart.reflectances[14]
    coefficients = SpectralBasis.balanced(chart.reflectances, chart.columns, enough).project(patch)
    print(f"The red patch: {np.array2string(coefficients, precision=2, max_line_width=110)}")


if __name__ == "__main__":
    main()
