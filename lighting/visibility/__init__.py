"""Free directions at each vertex of a scene: computed once by rays, kept small, looked up by renderers.

Begin with `visibility.py`; `refinement.py` bisects large triangles, `hidden_light.py` is the loss of one light,
`cache.py` keeps all of it on disk.
"""
