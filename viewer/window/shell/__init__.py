"""Window of the operating system: imgui draws panels, and input becomes commands; nothing outside imports imgui.

Begin with `main_loop.py`; `panels/` has a file a panel.
"""
