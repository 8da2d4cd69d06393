"""Characterisation of a display: readings, a model fitted to them, its inverse, and later verification.

In order: `patches` chooses what to measure, `reading_files` reads an instrument's file, `drift` removes the warm-up of
the display, `choice` fits the models of `model_fit` and selects one, `inverse` finds the nearest codes for a colour,
and `cube` tabulates them. `verification` judges new readings. `record` stores all of it in a file.
"""
