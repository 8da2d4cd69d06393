"""Methods of papers that exist here to be compared with, and in no product.

Begin with `distribution_based.py`: one distribution of half vectors, fitted to any BRDF. `btf_fields.py` has published
models of BTFs, `harmonics.py` light and visibility in few harmonics. `gaussian_lobes/` are the 2009 paper's spherical
Gaussians; `transfer_tensors/` relights scenes by the 2007 paper's way, and `site_relighting/` the same vertices by rays
that are kept.
"""
