"""Sources with a known luminance, and independent statements of what the package computes."""
