"""Light from many directions at once: maps, booths, softboxes, and their prefiltered forms.

Begin with `environment.py`, the light; `prefiltering.py` makes it ready for lobes.
"""
