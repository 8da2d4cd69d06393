"""Progress of work that takes long: begin with `lines`, a bar for any count; `fit` and `imports` know their work."""
