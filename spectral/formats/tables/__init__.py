"""The table in a text file, step by step: how cells are parted (`dialect`), where the wavelengths are (`layout`), the
columns (`parsing`, `down`, `column`), and what they become (`entries`).
"""
