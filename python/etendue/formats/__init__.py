"""Published file formats: bytes to quantities and back, with every complaint."""
