"""What LightTools ray files, binary and text, hold of the colour of rays."""

from __future__ import annotations

from etendue.formats.rays.shared import Colour, RayColour, Written, losses
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import RayStream

NO_COLOUR, WAVELENGTH, TRISTIMULUS = "none", "wavelength", "tristimulus"
"""The words of the text format for what stands beside, or in place of, the flux."""

TRISTIMULUS_COLUMNS = ("tristimulus_x", "tristimulus_z")
"""Columns that make tristimulus values together with the luminous flux, which is Y."""


def held_colour(rays: RayStream, colour: RayColour) -> str:
    """What a file of these rays can hold: wavelengths beside watts, X and Z beside lumens, or nothing."""
    if colour.has_wavelengths and rays.flux_unit == "W":
        return WAVELENGTH
    if isinstance(rays, RaySet) and rays.flux_unit == "lm" and set(TRISTIMULUS_COLUMNS) <= set(rays.columns):
        return TRISTIMULUS
    return NO_COLOUR


def colour_losses(rays: RayStream, written: Written, colour: RayColour, held: str) -> tuple[str, ...]:
    """What a file that holds `held` does not say of the rays, one sentence each."""
    kept = TRISTIMULUS_COLUMNS if held == TRISTIMULUS else ()
    notes = list(losses(rays, written, colour, colour_kept=held == WAVELENGTH, kept=kept))
    if colour.kind is Colour.PER_RAY and held != WAVELENGTH:
        notes.append(
            "LightTools takes wavelengths only beside watts; to keep them, convert the rays to watts: --unit W, or "
            "RaySet.in_unit('W') in Python."
        )
    if colour.kind is Colour.ONE_SPECTRUM:
        notes.append("LightTools takes the spectrum from an .sre file that is chosen with the source.")
    return tuple(notes)
