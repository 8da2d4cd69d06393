"""The `metamer` command: one small module per subcommand, a folder for a subcommand with verbs.

Begin with `main.py` and `parser.py`, which lists the subcommands; each module has `add_parser` and `run`. They share
`options.py`, `output.py` and `progress/`.
"""
