"""A ray file on a page: what it says, what its light field resolves, what it looks like, and how sure all that is."""

from __future__ import annotations

import dataclasses
import functools
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from etendue.errors import ArgumentError
from etendue.formats.rays import read_rays
from etendue.formats.rays.facts import fact_rows, ray_facts
from etendue.lightfield.carrier import Surface
from etendue.lightfield.diagnostics import Diagnostics, diagnose
from etendue.lightfield.fit_cache import fit_or_recall
from etendue.lightfield.forecast import FEWEST_RAYS, REFITS
from etendue.luminance.estimate import luminance_map
from etendue.luminance.framing import centre_of_light, framed, light_towards, probe
from etendue.quantities.arguments import require
from etendue.quantities.data_sheet import DataSheet, data_sheet
from etendue.quantities.intensity import Intensity
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.measured import measured
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.powers_of_ten import counted
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import Progress

VIEWS = ((0.0, 0.0), (30.0, 0.0), (60.0, 0.0), (60.0, 90.0))
"""The standard set of observers: θ, φ [°]; 180° - θ of a source that shines down."""

DOWN = 0.9
"""Share of the flux that heads down if a source is to be looked at from below."""

DISTANCE = 1000.0
"""Of the observers from the light [mm]; further if the light is wider than a tenth of that."""

PIXELS = 128


@dataclasses.dataclass(frozen=True, eq=False)
class SourceReport:
    """What is to be said of a source of which there are rays; see `report_source`.

    Parameters
    ----------
    title : str
        First line.
    facts : tuple of (str, str)
        What the file says and what its rays do: label and text.
    complaints : tuple of str
        What is wrong with the file.
    diagnostics : Diagnostics
        How good the light field is, what it resolves, and what more rays would bring.
    maps : tuple of LuminanceMap
        From the observers, on one size of screen.
    intensity : Intensity
        Of the light field.
    notes : tuple of str
        What was done to the rays, oldest first.
    provenance : tuple of (str, str)
        File, fingerprint, program and steps.

    Examples
    --------
    >>> import etendue as et
    >>> rays, disk = et.RingSource(rays=20_000).ray_set(), et.Disk(radius=30)
    >>> found = report_source(rays, surface=disk, observers=[et.Observer(0, 0, 1000)], forecast=False)
    >>> [row[0] for row in found.view_rows()[0]][:2], len(found.maps)
    (['θ', 'φ'], 1)
    """

    title: str
    facts: tuple[tuple[str, str], ...]
    complaints: tuple[str, ...]
    diagnostics: Diagnostics
    maps: tuple[LuminanceMap, ...]
    intensity: Intensity
    notes: tuple[str, ...]
    provenance: tuple[tuple[str, str], ...]

    def __repr__(self) -> str:
        """Title and number of views."""
        return f"<SourceReport of {self.title}, {len(self.maps)} maps>"

    @functools.cached_property
    def sheet(self) -> DataSheet:
        """Beam and field angle, cut-off, zonal flux."""
        return data_sheet(self.intensity)

    @property
    def subtitle(self) -> str:
        """What the report is, in a line."""
        return f"report of a light source, {counted(self.diagnostics.flux, self.diagnostics.flux_unit)}"

    @property
    def quality_lines(self) -> list[str]:
        """What the light field is, resolves, and what more rays would bring."""
        found = self.diagnostics
        surface = re.sub(r"\d+\.\d+", lambda number: f"{float(number[0]):.4g}", found.surface)
        lines = [f"on {surface}", *found.summary().splitlines()]
        return [line for line in lines if not line.startswith("least certain")]

    def view_rows(self) -> list[list[tuple[str, str]]]:
        """For each map: name and text of its direction, size, maximum, intensity and errors."""
        rows = []
        for lmap in self.maps:
            unit = lmap.unit
            row, column = divmod(int(lmap.values.argmax()), lmap.screen.columns)
            error = lmap.relative_error
            rows.append(
                [
                    ("θ", f"{lmap.observer.theta:g}°"),
                    ("φ", f"{lmap.observer.phi:g}°"),
                    ("largest pixel", measured(lmap.values[row, column], lmap.standard_error[row, column], unit)),
                    ("intensity", counted(lmap.intensity, self.intensity.unit)),
                    ("error, weighted by flux", "unknown" if error is None else f"{error.flux_weighted:.2%}"),
                ]
            )
        return rows

    def to_dict(self) -> dict[str, Any]:
        """In figures, as plain data."""
        return {
            "title": self.title,
            "facts": [list(row) for row in self.facts],
            "complaints": list(self.complaints),
            "diagnostics": self.diagnostics.to_dict(),
            "views": [dict(row) for row in self.view_rows()],
            "data_sheet": self.sheet.to_dict(),
            "notes": list(self.notes),
            "provenance": [list(row) for row in self.provenance],
        }


def report_source(
    source: RaySet | str | os.PathLike[str],
    *,
    surface: Surface | Literal["auto"] = "auto",
    observers: Sequence[Observer] | None = None,
    title: str | None = None,
    forecast: bool = True,
    seed: int = 1,
    cache: bool = True,
    threads: int | None = None,
    progress: Progress | None = None,
) -> SourceReport:
    """Fit a light field to rays, look at it from a standard set of directions, and say how sure everything is.

    Parameters
    ----------
    source : RaySet or path
        Rays, or a ray file of any format.
    surface : Surface or "auto"
        Carrier surface, as `LightField.fit` takes it.
    observers : sequence of Observer, optional
        (0°, 0°), (30°, 0°), (60°, 0°) and (60°, 90°) at 1 000 mm about the point that the light seems to come from, or ten
        times as far as that light is wide, if not given; from below, at 180° - θ, if nine tenths of it or more head down.
    title : str, optional
        Name of the file if not given.
    forecast : bool
        Whether parts of the rays are fitted again to say what more of them would bring, for about the time of the fit. A
        note tells if there are too few, 4 000.
    seed : int
        Of the rays held out.
    cache : bool
        Whether a light field that was fitted to the same rays before is taken, and this one kept; see `cache_content`.
    threads : int, optional
        All cores if not given; the result does not depend on it.
    progress : callable, optional
        Told how many rays have been fitted; with a forecast they count once more for its fits.

    Returns
    -------
    SourceReport
        `etendue.plot_report` draws it as a page.

    Raises
    ------
    FormatError
        If the file is no ray file.
    ArgumentError
        If there are no rays with positions, or no observers, or no light heads for any of them.

    Examples
    --------
    >>> import etendue as et
    >>> rays, disk = et.RingSource(rays=20_000).ray_set(), et.Disk(radius=30)
    >>> report_source(rays, surface=disk, title="Rings", forecast=False)
    <SourceReport of Rings, 4 maps>
    """
    rays = source if isinstance(source, RaySet) else read_rays(source)
    name = rays.provenance.source if isinstance(source, RaySet) else str(source)
    if observers is not None:
        require(
            observers, Sequence, "report_source: observers", "et.Observer(theta, phi, distance) in a sequence, or None"
        )
        for one in observers:
            require(one, Observer, "report_source: one of the observers", "an et.Observer(theta, phi, distance)")
    if observers is not None and not observers:
        raise ArgumentError("report_source: the sequence of observers is empty; give at least one.")
    facts = fact_rows(ray_facts(rays, name))
    field = fit_or_recall(rays, surface, seed=seed, cache=cache, threads=threads, progress=progress)

    def refitted(done: int) -> None:
        if progress is not None:
            progress(len(rays) * (REFITS + done) // REFITS)

    enough = len(rays) >= FEWEST_RAYS
    few = [f"{len(rays):,} rays are too few to forecast what more would bring; {FEWEST_RAYS:,} are not"]
    found = diagnose(field, rays if forecast and enough else None, seed=seed, threads=threads, progress=refitted)
    some = probe(field)
    views = list(observers) if observers is not None else _standard(some)
    width = _width(some, views)
    screen = Screen(width, width, PIXELS, PIXELS)
    maps = luminance_map(field, views, screen, threads=threads)
    origin = field.provenance
    steps = [("done", step) for step in origin.steps]
    return SourceReport(
        title=title if title is not None else Path(name).name,
        facts=tuple(facts),
        complaints=tuple(str(complaint) for complaint in rays.complaints),
        diagnostics=found,
        maps=tuple(maps),
        intensity=field.intensity(),
        notes=(*field.notes, *(few if forecast and not enough else [])),
        provenance=(
            ("source", Path(name).name),
            ("fingerprint", origin.fingerprint or "none: rays in memory"),
            ("program", origin.software),
            *steps,
        ),
    )


def _standard(some: RaySet) -> list[Observer]:
    """The standard set about the light of which these are some rays, far enough for its size."""
    target = centre_of_light(some)
    down = float(some.flux[some.direction[:, 2] < 0.0].sum()) >= DOWN * some.total_flux
    views = [(180.0 - theta if down else theta, phi) for theta, phi in VIEWS]
    distance = max(DISTANCE, 10.0 * _width(some, [Observer(*view, DISTANCE, target=target) for view in views]))
    return [Observer(*view, distance, target=target) for view in views]


def _width(some: RaySet, views: Sequence[Observer]) -> float:
    """Of a square screen that shows the light to all who see any [mm]."""
    screen = Screen(1.0, 1.0, PIXELS, PIXELS)
    lit = [view for view in views if light_towards(some, view, screen).flux.any()]
    return max(framed(some, view, PIXELS, PIXELS).width for view in lit or views)
