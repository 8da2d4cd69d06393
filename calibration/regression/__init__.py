"""Regression of colours: two sets of results, matched row by row and judged by criteria.

One concept per file: `row` (what is compared), a file per kind of source (`review_folder`, `picture_files`,
`readings`), `sources` (which of them a path is), `matching`, `change` (two layers), `criteria`, `self_test` (the check
of itself), `comparison` (all of it in order) and its `result`; `suite`, `baseline`, `accept`; a file per output format;
`assertions` for tests.
"""
