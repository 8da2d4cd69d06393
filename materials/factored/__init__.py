"""Factor packs: the fast form of uniform materials, in numpy and on the GPU."""
