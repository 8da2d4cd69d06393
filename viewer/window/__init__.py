"""Review window, `metamer view`: its state, every change of it, its pictures and probes.

Begin with `state.py`; `commands.py` is the type of a change, `command_list.py` has all with their
keys; `frame.py` is the picture. Panels are in `shell/`.
"""
