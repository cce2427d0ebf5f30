"""What may be known of a luminaire beside its intensity, and what becomes of its extents when it is turned."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

LUMINAIRE_FACTS: dict[str, str] = {
    "manufacturer": "name",
    "luminaire": "name or description",
    "catalogue_number": "of the luminaire",
    "lamp": "description",
    "test_report": "number or description",
    "laboratory": "that tested",
    "issue_date": "of the data, as the file spells it",
    "lamps": "number of lamps",
    "lamp_flux": "flux of all lamps together [lm]; missing for absolute photometry",
    "stated_flux": "flux of the luminaire [flux unit] that a file states, if it does",
    "input_power": "[W]",
    "linear": "whether the luminaire is a linear one (EULUMDAT type 2)",
    "opening_shape": "luminous opening: point, rectangle, box, circle, ellipse, sphere, …",
    "opening_x": "its extent along C0-C180 [mm]",
    "opening_y": "its extent along C90-C270 [mm]",
    "opening_z": "its extent along the axis [mm]",
    "housing_x": "extent of the luminaire along C0-C180 [mm]",
    "housing_y": "extent of the luminaire along C90-C270 [mm]",
    "housing_z": "extent of the luminaire along the axis [mm]",
    "housing_round": "whether the luminaire is round, if a file says so",
    "opening_heights": "height of the luminous opening at C0, C90, C180, C270 [mm], where they differ",
    "extents_turned": "angle by which opening and luminaire stand turned from these axes, towards C90 [°], if they do",
    "lamp_sets": "every lamp set of an EULUMDAT file, one mapping each",
    "measurement_tilt": "tilt of the luminaire when it was measured [°], of an EULUMDAT file; nothing was turned back",
    "conversion_factor": "for intensities, of an EULUMDAT file, if it is not 1; not applied",
    "direct_ratios": "ten of an EULUMDAT file, if it has any",
    "tilt": "lamp factors over the tilt of the luminaire, of an IES file; not applied",
    "spectrum": "`Spectrum` or `SpectralLines` of all its light, if a file or the rays tell it",
    "keywords": "every keyword line of an IES file, as pairs",
}
"""What may be known of the luminaire beside its intensity, with its meaning."""

OTHER_WAY = {"cylinder along length": "cylinder along width", "cylinder along width": "cylinder along length"}
"""Shapes of openings that a quarter of a turn gives another name."""

QUARTER_TURN = 1e-3
"""Degrees within which a turn is one by a multiple of 90° for extents: over a metre they move by less than 0.02 mm."""


def turned_facts(facts: Mapping[str, Any], angle: float) -> dict[str, Any]:
    """Extents after a turn about the axis [°]: to the nearest quarter, and what is left as `extents_turned`.

    Examples
    --------
    >>> turned_facts({"opening_shape": "rectangle", "opening_x": 600.0, "opening_y": 80.0}, 90.0)["opening_y"]
    600.0
    """
    result = dict(facts)
    whole = angle + float(result.pop("extents_turned", 0.0))
    quarters = round(whole / 90.0)
    for what in ("opening", "housing"):
        x, y = (result.pop(f"{what}_{axis}", None) for axis in ("yx" if quarters % 2 else "xy"))
        result |= {f"{what}_{axis}": extent for axis, extent in (("x", x), ("y", y)) if extent is not None}
    if quarters % 2 and result.get("opening_shape") in OTHER_WAY:
        result["opening_shape"] = OTHER_WAY[result["opening_shape"]]
    if "opening_heights" in result:
        result["opening_heights"] = tuple(result["opening_heights"][(k - quarters) % 4] for k in range(4))
    left = whole - 90.0 * quarters
    if abs(left) > QUARTER_TURN and (has_corners(facts, "opening") or has_corners(facts, "housing")):
        result["extents_turned"] = left
    return result


def has_corners(facts: Mapping[str, Any], what: Literal["opening", "housing"]) -> bool:
    """Whether the extents of the luminous opening or the housing are known, and a turn about the axis changes them.

    Examples
    --------
    >>> has_corners({"opening_shape": "circle", "opening_x": 80.0, "opening_y": 80.0}, "opening")
    False
    """
    x, y = (facts.get(f"{what}_{axis}", 0.0) for axis in "xy")
    box = facts.get("opening_shape") in {"rectangle", "box"} or "opening_heights" in facts
    return bool(x or y) and (x != y or (box if what == "opening" else not facts.get("housing_round")))


def mirrored_facts(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Extents of the mirror image in the plane C0-C180: C90 and C270 change places.

    Examples
    --------
    >>> mirrored_facts({"opening_heights": (1.0, 2.0, 3.0, 4.0)})
    {'opening_heights': (1.0, 4.0, 3.0, 2.0)}
    """
    heights = facts.get("opening_heights", ())
    result = dict(facts) | ({"opening_heights": tuple(heights[k] for k in (0, 3, 2, 1))} if heights else {})
    return result | ({"extents_turned": -facts["extents_turned"]} if "extents_turned" in facts else {})
