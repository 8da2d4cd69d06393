"""Surfaces that vary from place to place: textures, original and fast form."""
