"""Whether a photometer at some distance sees the far field of a lamp."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from etendue.instruments.near_field.setting import Setting
from etendue.quantities.intensity import Intensity

Array = npt.NDArray[np.float64]

FAR = 15.0
"""Sizes of the lamp from which a photometer stands in its far field [CIE1211996]_; the default distance."""

ROUNDED = 0.06
"""By which share the distance may be less: it is rounded to two digits."""

NARROW = 0.01
"""Error of the photometer's peak intensity from which the beam is called too narrow for its distance."""

LOWERED = math.log(2.0) / 2.0
"""Of the peak of a Gaussian beam of full width w, by an even disk that is seen under β: this times (β/w)².

Each point of the disk sends its beam past the photometer by up to β/2; the mean square of that is β²/8, and the peak falls
by the mean of 4 ln 2 (angle/w)².
"""

LINEAR = 2.0 * math.log(2.0) / 3.0
"""Of a Gaussian beam of full width w about its peak, by straight lines between positions in steps s: this times (s/w)².

Between two positions the lines are s²/12 of the second derivative too low on average, which is 8 ln 2/w² of the peak there.
"""

FLUX_OF_TABLE = 5e-3
"""By which share the flux of a table may differ from that of the photometer without a note."""

MISSED = 5e-3
"""Share of the total flux that may be missed between positions without a note."""

STEPS_PER_BEAM = 3.0
"""Positions that a beam should have within its width along γ."""

AROUND_PER_BEAM = 1.5
"""Likewise along C, where even weights on a circle converge faster.

Of a Gaussian of width w, in steps s, the integral is off by up to 2 exp(−2π² (w/2.355 s)²): 0.07 % at w = 1.5 s, 6 % at s.
"""


def far_field_notes(setting: Setting, values: Array) -> Iterator[str]:
    """What is to be said of intensities by a photometer.

    Parameters
    ----------
    setting : Setting
        Of the measurement.
    values : array, shape (planes, rings)
        Illuminance times the square of the distance.

    Examples
    --------
    >>> import etendue as et
    >>> disk = {"kind": "surface", "shape": {"kind": "disk", "radius": 2}, "flux": 100}
    >>> near = et.NearFieldGoniophotometer((30, 90), distance=40, camera_pixels=16)
    >>> near.measure(et.Scene(sources=[disk]), samples=2).intensity().notes[0]  # doctest: +ELLIPSIS
    "the photometer stands 7.07 times the lamp's size of 5.657 mm away; from 15 times on its intensities are ..."
    """
    size, distance = setting.lamp_size, setting.photometer_distance
    if distance < FAR * size * (1.0 - ROUNDED):
        yield (
            f"the photometer stands {distance / size:.3g} times the lamp's size of {size:.4g} mm away; from {FAR:g} times "
            "on its intensities are those of the far field"
        )
    plane, ring = np.unravel_index(int(np.argmax(values)), values.shape)
    width = full_width(setting.positions.rings, values[plane], int(ring))
    seen = math.degrees(size / distance)
    lowered = LOWERED * (seen / width) ** 2
    if lowered > NARROW:
        yield (
            f"the beam is {width:.3g}° wide and the lamp is seen under {seen:.3g}°: the peak by the photometer is too low "
            f"by some {min(lowered, 1.0):.0%}; the intensity distribution of the rays has no such error"
        )


def step_notes(setting: Setting, values: Array) -> Iterator[str]:
    """What is to be said of a beam that is narrow against the steps between positions, along γ and around the axis.

    Parameters
    ----------
    setting : Setting
        Of the measurement.
    values : array, shape (planes, rings)
        Illuminance times the square of the distance.

    Examples
    --------
    >>> from etendue.instruments.near_field.camera import Camera
    >>> from etendue.instruments.near_field.positions import ArmPositions
    >>> stops = ArmPositions(30, 90)
    >>> setting = Setting(stops, Camera(8), 100.0, 100.0, 5.0, (0.0, 0.0, 0.0), 4.0)
    >>> next(step_notes(setting, np.maximum(np.cos(np.radians(stops.table(stops.gamma))), 0) ** 10))
    'the beam is 39.3° wide along γ, and positions are 30° apart: the total flux, and the scale of the images ...'
    """
    ways = (STEPS_PER_BEAM, "along γ"), (AROUND_PER_BEAM, "along C")
    for (least, way), (width, step) in zip(ways, _widths(setting, values), strict=True):
        if width < least * step:
            yield (
                f"the beam is {width:.3g}° wide {way}, and positions are {step:.3g}° apart: the total flux, and the scale "
                "of the images with it, may be off by more than the stated error; take smaller steps"
            )


def integral_notes(setting: Setting, illuminance: Array, errors: Array) -> Iterator[str]:
    """What is to be said of light that changes too fast between positions for the total flux.

    Parameters
    ----------
    setting : Setting
        Of the measurement.
    illuminance, errors : array, shape (n,)
        By the photometer at each position, and its standard error.

    Examples
    --------
    >>> from etendue.instruments.near_field.camera import Camera
    >>> from etendue.instruments.near_field.positions import ArmPositions
    >>> stops = ArmPositions(5, 10)
    >>> setting = Setting(stops, Camera(8), 100.0, 100.0, 5.0, (0.0, 0.0, 0.0), 4.0)
    >>> cut = (stops.gamma < 52) * np.cos(np.radians(stops.gamma))
    >>> next(integral_notes(setting, cut, 0 * cut))
    'the light changes much between positions: the total flux, and the scale of the images with it, may be off by some ...'
    """
    stops = setting.positions
    total = float(stops.weight @ illuminance)
    missed = stops.missed(illuminance, errors)
    if missed > MISSED * total:
        yield (
            "the light changes much between positions: the total flux, and the scale of the images with it, may be off by "
            f"some {missed / total:.1%}, which the stated error does not hold; take smaller steps"
        )


def linear_notes(setting: Setting, values: Array) -> Iterator[str]:
    """What is to be said of rays whose light is linear between positions, by a Gaussian beam of the same widths.

    Parameters
    ----------
    setting : Setting
        Of the measurement.
    values : array, shape (planes, rings)
        Illuminance times the square of the distance.

    Examples
    --------
    >>> from etendue.instruments.near_field.camera import Camera
    >>> from etendue.instruments.near_field.positions import ArmPositions
    >>> stops = ArmPositions(5, 10)
    >>> setting = Setting(stops, Camera(8), 100.0, 100.0, 5.0, (0.0, 0.0, 0.0), 4.0)
    >>> beam = np.maximum(np.cos(np.radians(stops.table(stops.gamma))), 0)
    >>> list(linear_notes(setting, beam**40))
    ['the light of the rays is linear between positions, which lowers it about its peak by some 2.5%; take smaller steps']
    >>> list(linear_notes(setting, beam))
    []
    """
    # On the axis there is nothing to go around.
    lowered = sum(LINEAR * (step / width) ** 2 for width, step in _widths(setting, values) if step > 0.0)
    if lowered > NARROW:
        yield (
            "the light of the rays is linear between positions, which lowers it about its peak by some "
            f"{min(lowered, 1.0):.1%}; take smaller steps"
        )


def _widths(setting: Setting, values: Array) -> tuple[tuple[float, float], tuple[float, float]]:
    """Full width of the beam at half its maximum and the step between positions, along γ and along C [°]."""
    stops = setting.positions
    plane, ring = np.unravel_index(int(np.argmax(values)), values.shape)
    away = math.sin(math.radians(stops.rings[ring]))
    half = stops.planes.size // 2
    turned = np.roll(values[:, ring], half - plane)
    along = full_width(stops.rings, values[plane], int(ring)), stops.step_gamma
    return along, (full_width(stops.planes, turned, half) * away, stops.step_c * away)


def table_notes(table: Intensity, total: float) -> Iterator[str]:
    """What is to be said of a table whose straight lines between positions have another flux than the photometer.

    Parameters
    ----------
    table : Intensity
        Of the positions.
    total : number
        Flux by the photometer, a spline through the same values.

    Examples
    --------
    >>> coarse = Intensity([0], [0, 30, 60, 90], [[100, 86.6, 50, 0]])
    >>> list(table_notes(coarse, 314.2))
    ['the table is linear between positions, which makes 306.8 lm of the 314.2 lm by the photometer; take smaller steps']
    >>> list(table_notes(coarse, 307.5))
    []
    """
    if abs(table.flux / total - 1.0) > FLUX_OF_TABLE:
        unit = table.flux_unit
        yield (
            f"the table is linear between positions, which makes {table.flux:.4g} {unit} of the {total:.4g} {unit} by the "
            "photometer; take smaller steps"
        )


def full_width(rings: Array, profile: Array, peak: int) -> float:
    """Full width of a beam at half its maximum along γ [°]; past a pole it goes on as on this side.

    Parameters
    ----------
    rings, profile : array, shape (n,)
        γ [°] and intensity.
    peak : int
        Where that is largest.

    Examples
    --------
    >>> full_width(np.array([0.0, 10, 20, 30]), np.array([8.0, 6, 2, 0]), 0)
    30.0
    """
    half = profile[peak] / 2.0
    sides = []
    for some, at in ((profile[peak:], rings[peak:]), (profile[peak::-1], rings[peak::-1])):
        below = np.flatnonzero(some < half)
        if below.size:
            i = int(below[0])
            share = (some[i - 1] - half) / (some[i - 1] - some[i])
            sides.append(abs(at[i - 1] + share * (at[i] - at[i - 1]) - rings[peak]))
    if not sides:
        return math.inf
    return float(sum(sides)) if len(sides) == 2 else 2.0 * float(sides[0])
