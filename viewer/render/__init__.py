"""Render session: a scene, camera, light, observer and materials that change one at a time.

Begin with `session.py`; `cache.py` is the interface of back ends, `scene_layers.py` the layers that they draw.
"""
