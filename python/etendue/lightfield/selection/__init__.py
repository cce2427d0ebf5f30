"""Which carrier surface suits a ray set: surfaces are fitted to some of its rays and scored on the others."""
