"""The table in a text file, step by step: how cells are parted (`dialect`), where the wavelengths are (`layout`), the
tables (`parsing`, each a `section`) and their columns (`rows`, `long_form`), what these measure (`quantities`) and what
they become (`entries`).
"""
