"""Render sessions: a scene, camera, light, observer and materials that change one at a time.

Begin with `session.py`; `cache.py` is the interface of back ends, `scene_layers.py` builds the layers that they draw.
"""
