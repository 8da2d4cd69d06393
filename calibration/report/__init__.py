"""Reports: rows of a review, their page and JSON, plots and tables that other reports share.

Begin with `row.py`, one material under one light, and `report.py`, all of them.
"""
