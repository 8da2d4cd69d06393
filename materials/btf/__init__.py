"""Bidirectional texture functions: images of a sample from many sides under many lights, and their fast forms.

Begin with `images.py` and `hemisphere.py`, the measurement, and `form.py`, which chooses a fast form by its budget:
`local_pca.py`, `polynomials.py` or `lobe_field.py`, with `gathering.py` for environment light.
"""
