"""Interreflection between the parts of a scene, precomputed from its geometry.

Begin with `edge_refinement.py` and `hits.py`, sites and rays; `transport.py` and `indirect.py` are for renderings,
`influence.py` quantifies the colour that parts cast on each other.
"""
