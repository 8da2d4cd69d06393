"""Measured BRDFs between and beyond their readings: scattered pairs, MERL and RGL tables.

Begin with the module of the kind; `docs/adding_a_format.md` says what a new one needs.
"""
