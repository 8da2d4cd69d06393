"""Bidirectional texture functions: images of a sample from many sides under many lights, and their fast forms."""
