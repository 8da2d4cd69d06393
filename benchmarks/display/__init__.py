"""Displays made up to measure how well real ones would be characterised, driven and verified."""
