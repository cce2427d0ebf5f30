"""What a page shows, as plain data: a light field or a map, how it is looked at first, and what is said about it."""

from __future__ import annotations

import base64
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.lightfield.field_rays import FieldRays
from etendue.lightfield.light_field import LightField
from etendue.luminance.framing import centre_of_light, framed, probe
from etendue.quantities.node_choice import choose_nodes
from etendue.quantities.observer import Observer
from etendue.quantities.pixel_map import PixelMap
from etendue.quantities.powers_of_ten import counted
from etendue.units import LUMINANCE_UNIT
from etendue.viewer.field_tables import FieldTables

Array = npt.NDArray[np.float64]

MOST_BYTES = 5_000_000
"""Letters of the tables of a light field: with the page around them a file stays below 6 MB."""

DISTANCE = 1000.0
"""Of the first observer [mm], if the light is small against it."""

C_PLANES, GAMMA_STEP = 36, 2.5
"""Nodes of the intensity solid where it is smooth [°]: between these there are those that its beams ask for."""

SAMPLE = 20_000
"""Rays drawn from a field that those are chosen by."""

MOST_DIRECTIONS = 24_000
"""Of the solid."""

INTENSITY_POINTS = 32
"""Points along either side of a part over which intensity is summed."""

DARK = 0.02
"""Share of the largest intensity below which the source is not looked at along its axis first."""

ASIDE = 10.0
"""Distance of the first observer at least, in widths of what is seen."""


def field_subject(field: LightField, name: str, file: str, options: str = "") -> dict[str, Any]:
    """A light field for the page.

    Parameters
    ----------
    field : LightField
        Kept in tables.
    name : str
        Title of the page.
    file : str
        As commands name it.
    options : str
        Of the command that makes a map of the file by this field, with a space behind them.
    """
    tables, packed = FieldTables.within(field, MOST_BYTES)
    solid = intensity_solid(field)
    resolved = field.resolution()
    percent = f"{100 * tables.bound:.2g} %"
    return {
        "kind": "field",
        "name": name,
        "file": file,
        "options": options,
        "facts": _facts(field),
        "quantity": "luminance" if field.flux_unit == "lm" else "radiance",
        "unit": LUMINANCE_UNIT[field.flux_unit],
        "flux_unit": field.flux_unit,
        "view": first_view(field, solid),
        "field": packed,
        "intensity": solid,
        "resolution": {
            "pitch": resolved.place,
            "text": f"Resolves {resolved.summary()}. Circle: that pitch; lines: cells.",
        },
        "accuracy": (
            f"The light field is kept in steps: each luminance is within ±{percent} of that of étendue from the same "
            "file. ± is the standard error of the light field itself, the mean over one pixel."
        ),
        "notes": [*field.notes, field.provenance.source],
        "geometry": None,
        "server": None,
    }


def map_subject(lmap: PixelMap, name: str, file: str) -> dict[str, Any]:
    """A map for the page: its pixels as they are, in single precision."""
    return {
        "kind": "map",
        "name": name,
        "file": file,
        "facts": f"{lmap.screen.columns} × {lmap.screen.rows} {lmap.PIXELS}{_seen_from(lmap)}",
        "quantity": lmap.quantity,
        "unit": lmap.unit,
        "flux_unit": lmap.flux_unit,
        "view": _map_view(lmap),
        "map": packed_map(lmap),
        "intensity": None,
        "resolution": None,
        "accuracy": "The pixels are those of the map, in single precision; ± is their standard error.",
        "notes": [*lmap.notes, lmap.provenance.source],
        "geometry": None,
        "server": None,
    }


def packed_map(lmap: PixelMap) -> dict[str, Any]:
    """The pixels of a map with the place of its screen, for `picture.js`."""
    observer = _observer_of(lmap)
    right, up, _ = lmap.screen.axes(observer)
    return {
        "columns": lmap.screen.columns,
        "rows": lmap.screen.rows,
        "width": lmap.screen.width,
        "height": lmap.screen.height,
        "target": list(observer.target),
        "right": right.tolist(),
        "up": up.tolist(),
        "eye": observer.position.tolist(),
        "values": _floats(lmap.values),
        "errors": _floats(lmap.standard_error),
    }


def _floats(values: Array) -> str:
    return base64.b64encode(values.astype("<f4").tobytes()).decode("ascii")


def _observer_of(lmap: PixelMap) -> Observer:
    found = getattr(lmap, "observer", None)
    return found if isinstance(found, Observer) else Observer(0.0, 0.0, DISTANCE)


def _seen_from(lmap: PixelMap) -> str:
    observer = getattr(lmap, "observer", None)
    if not isinstance(observer, Observer):
        return ""
    return f" from θ = {observer.theta:g}°, φ = {observer.phi:g}°, {observer.distance:g} mm"


def _map_view(lmap: PixelMap) -> dict[str, Any]:
    observer = _observer_of(lmap)
    return {**_view(observer, lmap.screen.width, lmap.screen.height), "plane": lmap.screen.plane}


def _view(observer: Observer, width: float, height: float) -> dict[str, Any]:
    return {
        "theta": observer.theta,
        "phi": observer.phi,
        "distance": observer.distance,
        "target": list(observer.target),
        "up": None if observer.up is None else list(observer.up),
        "roll": observer.roll,
        "width": width,
        "height": height,
    }


def first_view(field: LightField, solid: dict[str, Any]) -> dict[str, Any]:
    """How a field is looked at first: along its axis, or from where it is brightest if it is dark there."""
    values = np.array(solid["values"]).reshape(len(solid["c"]), -1)
    theta, phi = 0.0, 0.0
    if values[:, 0].mean() < DARK * values.max():
        plane, ring = np.unravel_index(int(values.argmax()), values.shape)
        theta, phi = float(solid["gamma"][ring]), float(solid["c"][plane])
    some = probe(field)
    target = centre_of_light(some)
    observer = Observer(theta, phi, DISTANCE, target)
    width = framed(some, observer).width
    if width * ASIDE > DISTANCE:
        observer = Observer(theta, phi, float(f"{width * ASIDE:.1g}"), target)
        width = framed(some, observer).width
    return _view(observer, width, width)


def intensity_solid(field: LightField) -> dict[str, Any]:
    """Intensity of a field towards the nodes of its solid [cd or W/sr], plane by plane."""
    c, gamma = solid_nodes(field)
    turn, lean = np.radians(c)[:, None], np.radians(gamma)[None, :]
    k = np.stack([np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean) + 0.0 * turn], axis=-1)
    values = field.core.intensity(np.ascontiguousarray(k.reshape(-1, 3)), INTENSITY_POINTS)
    return {
        "c": c.tolist(),
        "gamma": gamma.tolist(),
        "values": [float(f"{value:.5g}") for value in values],
        "unit": "cd" if field.flux_unit == "lm" else "W/sr",
    }


def solid_nodes(field: LightField) -> tuple[Array, Array]:
    """Planes C and angles γ [°] that hold the beams of a field: those of an intensity table, among even ones.

    Examples
    --------
    >>> import etendue as et
    >>> field = et.LightField.fit(et.RingSource(rays=2000), et.Disk(radius=30), depths=(3, 3, 2, 2))
    >>> c, gamma = solid_nodes(field)
    >>> float(c[0]), float(gamma[0]), float(gamma[-1]), len(c) * len(gamma) <= MOST_DIRECTIONS
    (0.0, 0.0, 180.0, True)
    """
    drawn = next(FieldRays(field, SAMPLE).batches())
    chosen = choose_nodes(drawn.direction, drawn.flux, SAMPLE).nodes
    c = np.union1d(np.arange(C_PLANES) * 360.0 / C_PLANES, chosen.planes)
    gamma = np.union1d(np.arange(0.0, 180.0 + GAMMA_STEP / 2, GAMMA_STEP), chosen.gamma)
    while c.size * gamma.size > MOST_DIRECTIONS:
        # The closest of both kinds are thinned out first; the ends of γ stay.
        if np.diff(c).min() * np.sin(np.radians(gamma)).max() < np.diff(gamma).min():
            c = np.delete(c, 1 + int(np.diff(c).argmin()))
        else:
            gamma = np.delete(gamma, 1 + int(np.diff(gamma[:-1]).argmin()))
    return c, gamma


def _facts(field: LightField) -> str:
    report = field.report
    unmet = report.unmet_flux / (report.unmet_flux + field.total_flux) if field.total_flux > 0 else 0.0
    left = f", {unmet:.2%} of the flux not met" if math.isfinite(unmet) and unmet > 0.001 else ""
    return f"{counted(field.total_flux, field.flux_unit)} · {report.rays:,} rays on {field.surface.NAME}{left}"
