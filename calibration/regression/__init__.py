"""Did any colour move? Two sets of results, matched row by row and held against criteria.

A file a concept: `row` (what is compared), a file a kind of source (`review_folder`, `picture_files`, `readings`),
`sources` (which of them a path is), `matching`, `change` (two layers), `criteria`, `self_test` (the check of itself),
`comparison` (all of it in order) and its `result`; `suite`, `baseline`, `accept`; a file a form that
the result is written in; `assertions` for tests.
"""
