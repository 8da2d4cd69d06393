"""Reports: rows of a review, their page and JSON, plots and tables shared with other reports.

Begin with `row.py`, one material under one light, and `report.py`, all of them.
"""
