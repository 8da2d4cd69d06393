"""Review window, `metamer view`: its state, commands, images and probes.

Begin with `state.py`; `commands.py` is the type of a command, `command_list.py` lists all with their keys; `frame.py`
is the image. Panels are in `shell/`.
"""
