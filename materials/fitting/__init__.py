"""Fit of factor packs: tables, decompositions, joint refinement on pairs that pictures show, guards of the bounds.

Begin with `search.py`, which tries frames and sizes; `joint.py` refines packs, `bounds.py` keeps them within bounds.
"""
