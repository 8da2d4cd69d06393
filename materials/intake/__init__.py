"""From whatever a person names to a filled catalogue: inputs, a plan, workers, one file a material."""
