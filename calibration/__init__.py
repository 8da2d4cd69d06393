"""Figures for users: reports, samples against standards, regressions, displays.

Begin with `report/`, whose plots and tables the others use; `match/`, `regression/` and `display/` are a command each.
"""
