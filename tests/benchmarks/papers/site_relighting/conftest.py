"""Rooms and bodies that the tests of interreflection share."""

from small_rooms import few_divisions, hollow, room, scene_of, squares

__all__ = ["few_divisions", "hollow", "room", "scene_of", "squares"]
