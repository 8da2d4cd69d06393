"""Materials on disk: one HDF5 file each, and finding, comparing and verifying them."""
