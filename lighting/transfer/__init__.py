"""Interreflection between the parts of a scene, found once for its geometry.

Begin with `edge_refinement.py` and `hits.py`, sites and rays; `transport.py` and `indirect.py` serve pictures,
`influence.py` says what parts put on each other.
"""
