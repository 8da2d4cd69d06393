"""Samples against their standard: differences, tolerances, uncertainty, metamerism, and the page that is signed."""
