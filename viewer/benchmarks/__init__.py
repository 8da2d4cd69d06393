"""What rendering costs and how far off it is: spectra at the pixel, filtered factors and, in `factor`, factor packs."""
