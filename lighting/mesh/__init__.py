"""Triangle meshes: their files, shapes that need none, normals, tangents and texture scale.

Begin with `mesh.py`, the type; `files.py` reads any format, each in a module of its name, and checks what it read.
"""
