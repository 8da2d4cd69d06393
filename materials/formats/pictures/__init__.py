"""Pictures of a material's properties: decoded (`textures`), told apart by name (`map_names`), reduced to the one
surface and the one light that stand for them (`stand_in`, `emission`), and kept in a record (`map_record`).
"""
