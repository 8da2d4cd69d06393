"""Scenes: cameras, lights, meshes, the spectral plan, and the reference renderer.

Begin with `scene.py` and `lights.py`; `plan.py` chooses the basis. `environment/`, `visibility/` and `transfer/` are
environment light, occlusion and interreflection.
"""
