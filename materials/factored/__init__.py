"""Factor packs: the fast form of uniform materials, in numpy and on the GPU.

Begin with `pack.py`, a pack and the sum of packs; `factors.glsl` is its twin, `pyramids.py` its mip-maps.
"""
