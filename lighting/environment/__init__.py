"""Light that comes from many directions at once."""
