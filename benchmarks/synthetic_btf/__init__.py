"""A truth of our own for BTFs: cloth, corduroy and leather that are made up, and traced at every wavelength.

Measured BTFs come as three colours, and often already compressed; what is claimed of a form is also measured on these.
Begin with `samples.py`, which makes a sample; `transport.py` traces it, `synthetic.py` gives its images.
"""
