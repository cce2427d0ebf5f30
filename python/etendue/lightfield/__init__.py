"""Light fields: luminance as flux density in étendue, on a carrier surface around the source."""
