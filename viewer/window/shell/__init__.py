"""The window itself: imgui draws panels, and what is done in them becomes commands; nothing outside imports imgui."""
