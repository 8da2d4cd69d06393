"""Surfaces that vary from place to place: textures and maps, original and fast form.

Begin with `maps.py`, the original, and `map_planes.py`, its fast form; `textures.py` decodes pictures.
"""
