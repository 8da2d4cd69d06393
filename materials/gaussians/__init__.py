"""Reflectance as a few spherical Gaussians: Wang, Ren, Gong, Snyder and Guo 2009."""
