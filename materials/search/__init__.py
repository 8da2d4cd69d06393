"""Search by appearance, and edits of what was found.

Begin with `neighbours.py`: the nearest materials of a catalogue, or the nearest after an `appearance_offset`, such as
"warmer".
"""
