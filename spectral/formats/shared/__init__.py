"""Parts that readers of several formats use; no module here is a format."""
