"""A truth of our own for BTFs: cloth, corduroy and leather that are made up, and traced at every wavelength.

Measured BTFs come as three colours, and often already compressed; what is claimed of a form is also measured on these.
They stand in `lighting` because rays do: `materials` has what a BTF is (`materials.btf.images`), and may not know of
Embree. `samples` makes a sample, `traced` says what its images are.
"""
