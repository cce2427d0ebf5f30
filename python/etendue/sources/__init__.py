"""Synthetic sources: rays with a closed-form luminance, drawn on demand and never stored."""
