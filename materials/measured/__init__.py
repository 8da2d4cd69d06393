"""Measured BRDFs between and beyond their readings: scattered pairs, MERL and RGL tables."""
