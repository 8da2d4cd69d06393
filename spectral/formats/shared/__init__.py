"""Parts that readers of several formats use; no module here is a format.

`words.py` says what headings mean, in the languages of `languages.py`; `decisions.py` what follows from several signs.
"""
