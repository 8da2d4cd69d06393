"""Review: every material under every light, drawn, compared with the reference and written.

Begin with `review.py`; `cases.py` lists the rows, `row_key.py` says when a kept row is still valid, `expected_work.py`
how long each takes.
"""
