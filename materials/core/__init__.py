"""Interfaces of surfaces, and the sum that renderers draw.

Begin with `surface.py`, the interface of originals, then `fast.py`: terms times palettes. `protocol.py` measures the
error of one against the other.
"""
