"""Pictures of a material's properties.

They are decoded (`textures`), told apart by name (`map_names`), averaged to one surface (`stand_in`), and stored in a
record (`map_record`).
"""
