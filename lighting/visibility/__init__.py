"""Precomputed visibility at the vertices of a scene: traced once, compressed, looked up by renderers.

Begin with `visibility.py`; `refinement.py` bisects large triangles, `hidden_light.py` is the occlusion of one light,
`cache.py` the cache on disk.
"""
