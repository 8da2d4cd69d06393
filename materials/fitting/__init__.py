"""Fit of factor packs: tables, decompositions, joint refinement on pairs drawn as pictures show them, and bounds.

Begin with `search.py`, which tries frames and sizes; `joint.py` refines packs, `bounds.py` keeps them within bounds.
"""
