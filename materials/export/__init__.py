"""Materials of a catalogue as files that other programs read.

Begin with `files.py`, which has a row for each format; `spectrum.py` finds the one spectrum that a table can hold.
"""
