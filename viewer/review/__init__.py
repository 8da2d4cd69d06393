"""Reviews: every material under every light, rendered, compared with the reference and reported.

Begin with `review.py`; `cases.py` lists the rows, `row_key.py` decides whether a cached row is valid,
`expected_work.py` estimates the time.
"""
