"""Pictures of a material's properties: decoded (`textures`), told apart by name (`map_names`), reduced to the one
surface that stands for them (`stand_in`), and kept in a record (`map_record`).
"""
