"""Files that hold a BSDF: one module per format, one registry, found by content."""
