"""Characterisation of a display: readings of it, a model of them, its inverse, and how far off it is later on.

The way through: `patches` says what to measure, `reading_files` reads what an instrument gave, `drift` takes out that
the display warmed up, `choice` fits the models of `model_fit` and takes one, `inverse` finds the codes that come
nearest to a colour, and `cube` tabulates them. `verification` judges new readings. `record` keeps all of it in a file.
"""
