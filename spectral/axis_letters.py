"""Axis letters of array shapes, declared once.

L  wavelengths            J  size of a spectral basis     R  rank of a CP factorisation
N  samples or entries     H, W  rows and columns of pixels

Signatures use them through jaxtyping (`Float[np.ndarray, "*batch L"]`); they are checked while tests run.
"""

import numpy as np
from jaxtyping import Float

Wavelengths = Float[np.ndarray, "L"]
XYZ = Float[np.ndarray, "*batch 3"]
Lab = Float[np.ndarray, "*batch 3"]
White = Float[np.ndarray, "3"]
Matrix3 = Float[np.ndarray, "3 3"]
