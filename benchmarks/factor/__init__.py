"""Factor packs beside what else the field has: `benchmark` runs it, `report` says what it found."""
