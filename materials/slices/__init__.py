"""BRDF slices as mixtures of spherical Gaussians: the environment form of uniform materials.

Begin with `view_slices.py`, the form and its GLSL twin.
"""
