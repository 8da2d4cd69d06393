"""BTFs in few numbers: what was published for them, beside what Metamer makes of them, and both beside the images."""
