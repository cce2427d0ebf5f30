"""From goniometer scans to a table: stages to directions, direction cosines, interpolation; thesis appendices A and B."""
