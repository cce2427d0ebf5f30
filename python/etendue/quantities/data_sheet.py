"""What a data sheet says of an intensity distribution: beam and field angle, cut-off, flux by zones, cd/klm."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from etendue.quantities.arguments import INTENSITY, require
from etendue.quantities.beam_angle import BEAM, FIELD, BeamAngle, beam_angle, cut_off_angle
from etendue.quantities.intensity import Intensity
from etendue.quantities.measured import measured
from etendue.quantities.zonal_flux import zonal_flux

FLUX_CODE_ZONES = (0.0, math.degrees(math.acos(0.75)), 60.0, math.degrees(math.acos(0.25)), 90.0, 180.0)
"""Angles γ that bound solid angles of π/2, π, 3π/2, 2π and 4π sr [°] [CIE0521982]_."""


@dataclasses.dataclass(frozen=True)
class DataSheet:
    """The figures of a data sheet; see `data_sheet`, which makes them.

    Parameters
    ----------
    beam, field : tuple of BeamAngle
        At 50 % and at 10 % of the largest intensity, in C0–C180 and C90–C270; one of each if the distribution is
        rotationally symmetric. Of light on both sides of the horizon that is dark there, those about γ = 0 and then those
        about γ = 180°, each of the largest intensity on its side.
    cut_off : float
        γ from which on no plane sends more than 1 % of the largest intensity [°]; NaN where that is not known to be above 0.
    zones : tuple of (float, float, float, float)
        γ from, γ to [°], flux, its standard error [`flux_unit`], in steps of 10°.
    flux_code : tuple of float
        CIE flux code N1 to N4 [%]: shares of the downward flux within solid angles of π/2, π and 3π/2 sr about the axis,
        and the downward share of all flux; and N5, flux of the luminaire over that of its lamps, where that is known
        [CIE0521982]_. NaN where there is no flux.
    per_klm : float
        What makes cd/klm of cd: 1 000 lm over the flux of the lamps where it is known, else that of the luminaire. NaN for
        watts.
    glare : tuple of (float, float, float)
        γ [°], at 65°, 70°, 80° and 90°; the largest intensity from there to 90°, less what chance lifts the largest of many
        noisy values by (`Intensity.largest_between`), and its standard error, NaN where unknown [cd/klm; cd or W/sr if
        `per_klm` is NaN].
    flux_unit : {"lm", "W"}

    Examples
    --------
    >>> sheet = data_sheet(Intensity(c=[0], gamma=[0, 30, 60], values=[[100.0, 50, 0]]))
    >>> sheet.beam[0].right, round(sheet.zones[0][2], 2)
    (30.0, 8.49)
    """

    beam: tuple[BeamAngle, ...]
    field: tuple[BeamAngle, ...]
    cut_off: float
    zones: tuple[tuple[float, float, float, float], ...]
    flux_code: tuple[float, ...]
    per_klm: float
    glare: tuple[tuple[float, float, float], ...]
    flux_unit: str

    def __repr__(self) -> str:
        """The widths."""
        return f"<DataSheet: beam angle {_angles(self.beam)}, field angle {_angles(self.field)}>"

    @property
    def reference(self) -> str:
        """What cd/klm are stated for: ``"lamps"`` if their flux is known, which N5 tells, else ``"luminaire"``."""
        return "luminaire" if math.isnan(self.flux_code[4]) else "lamps"

    def lines(self) -> list[str]:
        """The figures in a few lines."""
        found = [f"beam angle (50 %) {_angles(self.beam)}", f"field angle (10 %) {_angles(self.field)}"]
        if math.isnan(self.cut_off):
            found.append("cut-off unknown: chance alone could have made the peak")
        elif self.cut_off < 180.0:
            found.append(f"below 1 % of the peak from γ = {self.cut_off:.4g}° on")
        else:
            found.append("no cut-off at 1 % of the peak")
        code = " ".join("?" if math.isnan(share) else f"{share:.0f}" for share in self.flux_code)
        if not all(math.isnan(share) for share in self.flux_code):
            found.append(f"CIE flux code {code}")
        unit = "cd/klm" if math.isfinite(self.per_klm) else ("cd" if self.flux_unit == "lm" else "W/sr")
        largest = ", ".join(
            f"{gamma:.0f}° on {measured(value, error, '').rstrip()}" for gamma, value, error in self.glare
        )
        return [*found, f"largest intensity up to the horizontal, from γ = {largest} {unit}"]

    def to_dict(self) -> dict[str, Any]:
        """As plain data; what is not known is None."""
        return {
            "beam_angle": [_plain(one) for one in self.beam],
            "field_angle": [_plain(one) for one in self.field],
            "cut_off": _known(self.cut_off),
            "zonal_flux": [
                {"from": low, "to": high, "flux": flux, "standard_error": _known(error)}
                for low, high, flux, error in self.zones
            ],
            "cie_flux_code": [_known(share) for share in self.flux_code],
            "cd_per_klm_factor": _known(self.per_klm),
            "largest_from": [
                {"gamma": gamma, "intensity": value, "standard_error": _known(error)}
                for gamma, value, error in self.glare
            ],
        }


def data_sheet(intensity: Intensity) -> DataSheet:
    """What a data sheet says of a distribution: beam and field angle, cut-off, zonal flux, CIE flux code, cd/klm.

    Parameters
    ----------
    intensity : Intensity
        The distribution; the axis is γ = 0.

    Examples
    --------
    >>> import numpy as np
    >>> gamma = np.arange(0, 90.1, 0.5)
    >>> figures = data_sheet(Intensity(c=[0], gamma=gamma, values=[100 * np.cos(np.radians(gamma))]))
    >>> print("; ".join(figures.lines()[:4]))
    beam angle (50 %) 120°; field angle (10 %) 168.5°; below 1 % of the peak from γ = 89.43° on; CIE flux code 44 75 94 100 ?
    """
    require(intensity, Intensity, "data_sheet: intensity", INTENSITY)
    planes = (0.0,) if intensity.symmetry() == "rotational" else (0.0, 90.0)
    axes = (0.0, 180.0) if _shines_both_ways(intensity) else (None,)
    steps = np.arange(0.0, 180.1, 10.0)
    flux, error = zonal_flux(intensity, steps)
    down, total = zonal_flux(intensity, FLUX_CODE_ZONES)[0], intensity.flux
    below = float(down[:4].sum())
    lamps = _lamp_flux(intensity)
    shares = [100.0 * float(part) / below if below > 0.0 else math.nan for part in np.cumsum(down[:3])]
    code = (
        *shares,
        100.0 * below / total if total > 0.0 else math.nan,
        100.0 * total / lamps if lamps is not None else math.nan,
    )
    luminous = intensity.flux_unit == "lm" and (lamps or total) > 0.0
    per_klm = 1e3 / (lamps or total) if luminous else math.nan
    factor = per_klm if math.isfinite(per_klm) else 1.0
    largest = [(low, intensity.largest_between(low, 90.0)) for low in (65.0, 70.0, 80.0, 90.0)]
    return DataSheet(
        beam=tuple(beam_angle(intensity, c, about=axis) for axis in axes for c in planes),
        field=tuple(beam_angle(intensity, c, FIELD, about=axis) for axis in axes for c in planes),
        cut_off=cut_off_angle(intensity),
        zones=tuple(
            (float(low), float(high), float(one), float(off))
            for low, high, one, off in zip(steps, steps[1:], flux, error, strict=False)
        ),
        flux_code=code,
        per_klm=per_klm,
        glare=tuple((low, factor * found.value, factor * found.error) for low, found in largest),
        flux_unit=intensity.flux_unit,
    )


def _shines_both_ways(intensity: Intensity) -> bool:
    """Whether both sides of the horizon have a tenth of the peak, and the horizon less than half of what the darker has."""
    sides = [intensity.largest_between(*side).value for side in ((0.0, 90.0), (90.0, 180.0))]
    horizon = intensity.largest_between(90.0, 90.0).value
    return min(sides) >= FIELD * max(sides) > 0.0 and horizon < BEAM * min(sides)


def _lamp_flux(intensity: Intensity) -> float | None:
    """Flux of all lamps, if the file tells it and means lumens of lamps."""
    stated = intensity.luminaire.get("lamp_flux")
    return float(stated) if isinstance(stated, int | float) and stated > 0.0 and intensity.flux_unit == "lm" else None


def _plain(one: BeamAngle) -> dict[str, float | None]:
    return {name: _known(value) for name, value in dataclasses.asdict(one).items()}


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _angles(found: Sequence[BeamAngle]) -> str:
    planes, axes = len({one.plane for one in found}), {one.about for one in found}
    return ", ".join(
        str(one)
        + (f" in C{one.plane:.4g}–C{one.plane + 180:.4g}" if planes > 1 else "")
        + (f" about γ = {one.about:g}°" if len(axes) > 1 else "")
        for one in found
    )
