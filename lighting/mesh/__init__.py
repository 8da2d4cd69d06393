"""Triangle meshes: file formats, generated shapes, normals, tangents and texture scale.

Begin with `mesh.py`, the type; `files.py` reads and checks any format, each in a module of its name.
"""
