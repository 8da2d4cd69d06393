"""Effect coatings reconstructed from readings at several angles: flakes that lean, under a clear coat."""
