"""BRDF slices as mixtures of spherical Gaussians: the environment form of uniform materials."""
