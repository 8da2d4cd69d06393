"""Interreflection: what light does between the parts of a scene, found once for its geometry."""
