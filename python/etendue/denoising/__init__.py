"""Smoothing of counted images, with error bars: no light field is needed for it."""
