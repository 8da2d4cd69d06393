"""Glossy surfaces under environments: the 2009 paper's way to render them, beside others and beside the truth."""
