"""Which directions are free at each vertex of a scene: computed once by rays, kept small, asked by renderers."""
