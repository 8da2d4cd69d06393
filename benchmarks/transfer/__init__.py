"""Interreflection: what was published for materials that change, beside the truth that paths give."""
