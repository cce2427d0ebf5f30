"""Frozen values of the field: ray sets, maps, observers, spectra. Each knows its unit and its error."""
