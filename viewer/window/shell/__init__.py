"""Window of the operating system: imgui draws panels, and input becomes commands; nothing outside imports imgui.

Begin with `main_loop.py`; `keys.py` hears keys, `actions.py` acts for commands that change no session, `panels/` has a
file a panel.
"""
