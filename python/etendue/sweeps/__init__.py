"""Results of a scene over its parameters."""
