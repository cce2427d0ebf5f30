"""Scatter: models and tables of the BSDF, goniometer scans, interpolation, appearance."""
