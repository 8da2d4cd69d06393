"""Measured BRDFs, interpolated and extrapolated: scattered pairs, MERL and RGL tables.

Begin with the module of the kind; `docs/adding_a_format.md` describes the requirements of a new one.
"""
