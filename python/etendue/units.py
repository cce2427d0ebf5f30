"""Units at the door: the only module that holds conversion factors.

Inside: millimetre, steradian, lumen or watt, nanometre, radian. A factor that is not here is a defect.
"""

from __future__ import annotations

from typing import Literal, get_args

FluxUnit = Literal["lm", "W"]
FLUX_UNITS: tuple[FluxUnit, ...] = get_args(FluxUnit)

MM2_PER_M2 = 1e6
"""Square millimetres in a square metre: turns flux per (mm² sr) into cd/m² or W/(m² sr)."""

NM_PER_UM = 1e3
"""Nanometres in a micrometre (Zemax wavelengths)."""

LUMINOUS_EFFICACY_MAX = 683.0
"""K_m [lm/W]: maximum luminous efficacy of photopic vision, CIE 018:2019."""

RADIANCE_WHITE_EFFICACY = 179.0
"""WHTEFFICACY [lm/W] of Radiance's color.h: cd/m² = 179 · (W/(m² sr)) in Radiance pictures."""

MM_PER_LENGTH_UNIT: dict[str, float] = {
    "nm": 1e-6,
    "um": 1e-3,
    "mm": 1.0,
    "cm": 10.0,
    "m": 1000.0,
    "inch": 25.4,
    "feet": 304.8,
}
"""Millimetres in one of each length unit that a ray file may use."""

LUMINANCE_UNIT: dict[FluxUnit, str] = {"lm": "cd/m²", "W": "W/(m² sr)"}
"""Unit of a map that was made from flux in the given unit."""

LUMINANCE_NAME: dict[FluxUnit, str] = {"lm": "luminance", "W": "radiance"}
"""Name of the quantity whose unit is `LUMINANCE_UNIT`."""

INTENSITY_UNIT: dict[FluxUnit, str] = {"lm": "cd", "W": "W/sr"}
"""Unit of an intensity that was made from flux in the given unit."""

INTENSITY_NAME: dict[FluxUnit, str] = {"lm": "luminous intensity", "W": "radiant intensity"}
"""Name of the quantity whose unit is `INTENSITY_UNIT`."""

ILLUMINANCE_UNIT: dict[FluxUnit, str] = {"lm": "lx", "W": "W/m²"}
"""Unit of the flux density on a surface that was made from flux in the given unit."""

ILLUMINANCE_NAME: dict[FluxUnit, str] = {"lm": "illuminance", "W": "irradiance"}
"""Name of the quantity whose unit is `ILLUMINANCE_UNIT`."""

LUMENS_PER_KILOLUMEN = 1e3
"""Turns the cd/klm of EULUMDAT into cd."""

WATTS_PER_FILE_UNIT: dict[str, float] = {"w/sr": 1.0, "mw/sr": 1e-3, "uw/sr": 1e-6, "µw/sr": 1e-6, "μw/sr": 1e-6}
"""Watts per steradian in one of each unit that an IES file may name under [_INTENSITYUNITS], lower case."""
