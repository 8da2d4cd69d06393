"""Interreflection by precomputed transfer tensors (Sun et al. 2007), spectrally: the way that ours is compared with."""
