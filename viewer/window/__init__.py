"""The review window, `metamer view`: what is looked at, every change of it, what is told of it, and the panels."""
