"""Foundations without colour: errors, files that are whole or absent, locks, memory, worker processes, code hashes.

Begin with `errors.py`: `InputError` is how everything here says that it cannot go on; `progress.py` is the
time left of any work.
"""
