"""Appendix A of the thesis in pictures: the stages of the goniometer, and the coordinates of Harvey and Shack.

All that is drawn comes from the functions that read scans: `goniometer`, for eqs. A.1 and A.2, and `harvey_shack`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from etendue.plot import style
from etendue.quantities.bsdf_directions import mirrored
from etendue.scatter.scans import harvey_shack
from etendue.scatter.scans.goniometer import detector_direction, incident_direction
from experiments.panels import FAINT, INK, LINES, new_figure, save
from experiments.space_drawing import SHADED, View

Array = npt.NDArray[np.float64]

SPECULAR, SCATTERED, DIFFERENCE, LOCAL, INCIDENT, *_ = LINES
TURN = np.arange(0.0, 361.0, 3.0)
CENTRED = {"ha": "center", "va": "center", "size": style.LABEL_SIZE}


# --- the stages ------------------------------------------------------------------------------------------------------

AT_REST = (0.0, 0.0, 0.0, 0.0)
TURNED = (265.0, 30.0, 30.0, 25.0)
"""α, β, γ and δ in the second picture [°]."""


def sample_axes(gamma: float, delta: float) -> Array:
    """x, y and z of the turned sample in the coordinates that it has at rest, one a row.

    The detector goes to each axis of the latter in turn, and eq. A.2 says where that is on the sample.
    """
    return detector_direction([90.0, 0.0, 180.0], [0.0, 90.0, 0.0], gamma, delta).T


def draw_bench(view: View, alpha: float, beta: float) -> None:
    """Where the detector can be at α, and where it is."""
    view.line(detector_direction(TURN, 0.0, 0.0, 0.0))
    view.line(detector_direction(alpha, np.linspace(-40.0, 75.0, 41), 0.0, 0.0), lw=4.0)
    at, foot = detector_direction(alpha, beta, 0.0, 0.0), detector_direction(alpha, 0.0, 0.0, 0.0)
    view.line([np.zeros(3), foot], ls="--")
    view.line([0.08 * at, at], color=SCATTERED, lw=1.2)
    view.line([0.97 * at, 1.12 * at], color=SCATTERED, lw=8.0)


def draw_sample(view: View, gamma: float, delta: float) -> None:
    """Its face with both axes and the normal."""
    x, y, z = sample_axes(gamma, delta)
    t = np.radians(TURN)[:, None]
    view.face(0.45 * (np.cos(t) * x + np.sin(t) * y))
    for name, end, colour, away in (
        ("x", 0.58 * x, LOCAL, (9, 4)),
        ("y", 0.62 * y, LOCAL, (0, 9)),
        ("z", 0.8 * z, SPECULAR, (-8, -2)),
    ):
        view.arrow(np.zeros(3), end, colour, 1.2)
        view.label(end, name, colour, away)


def draw_turns(view: View, stages: Sequence[float], start: Sequence[float], end: Sequence[float]) -> None:
    """Arrows from angles of the stages to others: of β where the bench is, of δ on the sample as it stands."""
    alpha, beta, gamma, delta = np.linspace(start, end, 41).T
    for name, points, colour, away in (
        ("α", detector_direction(alpha, 0.0, 0.0, 0.0), INK, (0, 0)),
        ("β", detector_direction(stages[0], beta, 0.0, 0.0), SCATTERED, (11, 0)),
        ("γ", 0.6 * np.array([sample_axes(angle, 0.0)[2] for angle in gamma]), SPECULAR, (3, -9)),
        ("δ", 0.47 * np.array([sample_axes(stages[2], angle)[0] for angle in delta]), LOCAL, (9, 0)),
    ):
        view.turn(points, colour)
        # Inside the circle of the bench.
        view.label((0.87 if name == "α" else 1.0) * points[len(points) // 2], name, colour, away)


def draw_stages(path: Path) -> None:
    """A.1: all stages at 0 with their positive senses, and turned."""
    figure = new_figure(9.6, 4.0, "Stages of the goniometer: zero and positive sense of their angles", layout=None)
    light = incident_direction(0.0, 0.0)
    for column, stages in enumerate((AT_REST, TURNED)):
        axes = figure.add_axes((0.01 + 0.5 * column, 0.0, 0.48, 0.86))
        axes.set(xlim=(-1.35, 1.35), ylim=(-0.95, 1.0), aspect="equal")
        axes.set_axis_off()
        # The axis of the stages A and C points up.
        view = View(axes, 25.0, -38.0, (2, 0, 1))
        draw_bench(view, *stages[:2])
        view.arrow(1.6 * light, 0.05 * light, INCIDENT, 2.0)
        draw_sample(view, *stages[2:])
        view.label(1.6 * light, "light", INCIDENT, (0, -9))
        if stages is AT_REST:
            style.put_title(axes, "all angles 0, with arrows of 35°")
            draw_turns(view, stages, stages, (35.0, 35.0, 35.0, 35.0))
            view.label(detector_direction(0.0, 0.0, 0.0, 0.0), "detector", SCATTERED, (-32, 4))
            view.label(detector_direction(0.0, 75.0, 0.0, 0.0), "bench", FAINT, (22, 0))
            view.label(-0.45 * sample_axes(0.0, 0.0)[1], "sample", FAINT, (0, -9))
        else:
            style.put_title(axes, ", ".join(f"{a} = {b:g}°" for a, b in zip("αβγδ", stages, strict=True)))
            draw_turns(view, stages, AT_REST, stages)
            specular = detector_direction(180.0 + 2.0 * stages[2], 0.0, 0.0, 0.0)
            view.line([np.zeros(3), specular], color=SPECULAR, ls="--")
            view.label(specular, "specular:\nα = 180° + 2γ", SPECULAR, (0, -17))
    save(figure, path)


# --- the coordinates -------------------------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Construction:
    """A scattered direction as a goniometer sets it, and its coordinates.

    Parameters
    ----------
    stages : tuple of 4 floats
        α, β, γ and δ [°].
    """

    stages: tuple[float, float, float, float]

    @property
    def incident(self) -> Array:
        """To where the light comes from, eq. A.1."""
        return incident_direction(*self.stages[2:])

    @property
    def scattered(self) -> Array:
        """Where the detector is, eq. A.2."""
        return detector_direction(*self.stages)

    @property
    def coordinates(self) -> tuple[float, float]:
        """βsc = |β − β₀| and φsc [°]."""
        r, a = harvey_shack.coordinates(self.incident, self.scattered)
        return float(r), float(a)

    def at(self, radial: npt.ArrayLike, azimuth: npt.ArrayLike) -> Array:
        """β of coordinates, shape (…, 2)."""
        return harvey_shack.directions(self.incident, radial, azimuth)[..., :2]


CONSTRUCTIONS = {
    "A.2: normal incidence": (Construction((148.0, 20.0, 0.0, 0.0)), Construction((208.0, -32.0, 0.0, 0.0))),
    "A.3: light in the plane of y and z": (Construction((255.0, -24.0, 20.0, 90.0)),),
    "A.4: light from elsewhere": (Construction((235.0, -35.0, 45.0, 130.0)),),
}
"""By the figure of the thesis; φsc on both sides of 180°, beyond which A.6 and A.17 are wrong as printed."""


def draw_surroundings(view: View) -> None:
    """The plane of the sample, to where directions reach in it, and from aside the hemisphere above."""
    t = np.radians(TURN)
    view.face(np.column_stack([np.cos(t), np.sin(t)]))
    if view.elevation < 90.0:
        # A sphere looks as wide from everywhere.
        view.axes.plot(np.cos(t[TURN <= 180.0]), np.sin(t[TURN <= 180.0]), color=SHADED, lw=0.8)
    for name, end, away in (
        ("x", [1.25, 0.0, 0.0], (4, -7)),
        ("y", [0.0, 1.25, 0.0], (7, -4)),
        ("z", [0, 0, 1.2], (7, 0)),
    ):
        if name != "z" or view.elevation < 90.0:
            view.arrow(np.zeros(3), end, FAINT, 0.7)
            view.label(end, name, FAINT, away)


def draw_directions(view: View, one: Construction, name: str) -> None:
    """i, its specular direction and the scattered one as unit vectors, each with the line down to its projection."""
    normal = one.incident[2] == 1.0
    for text, vector, colour in (
        ("" if normal else "i", one.incident, INCIDENT),
        ("i = iₛ" if normal else "iₛ", mirrored(one.incident), SPECULAR),
        (name, one.scattered, SCATTERED),
    ):
        view.line([vector, [*vector[:2], 0.0]], color=colour, ls=":", lw=1.0)
        view.arrow(np.zeros(3), vector, colour)
        view.label(1.1 * vector + [0.0, 0.0, 0.03], text, colour, (18, -8) if normal and colour == SPECULAR else (0, 0))


def draw_projections(view: View, one: Construction, name: str = "") -> None:
    """β₀, β and β − β₀ in the plane of the sample; with their names and the local axes seen from above."""
    specular, scattered = one.at(0.0, 0.0), one.at(*one.coordinates)
    view.arrow(specular, scattered, DIFFERENCE, 2.0)
    sides = (("β₀", specular, SPECULAR, scattered), ("β", scattered, SCATTERED, specular)) if specular.any() else ()
    for text, end, colour, other in sides:
        view.arrow(np.zeros(2), end, colour, 1.2)
        if name:
            view.beside(np.zeros(2), end, text, colour, other)
    if not name:
        return
    view.label(scattered, f"β − β₀{name[1:]}", DIFFERENCE, (0.0, 10.0 if scattered[1] > 0.0 else -10.0))
    if sides:
        view.line([np.zeros(2), one.incident[:2]], color=INCIDENT, ls=":", lw=1.2)
        view.label(1.12 * one.incident[:2], "i", INCIDENT)
    x, y = harvey_shack.axes(one.incident)
    for text, axis, away in (("x′", x, (2.0, -9.0)), ("y′", y, (-10.0, 0.0))):
        view.arrow(specular, specular + 0.5 * axis, LOCAL, 1.0)
        view.label(specular + 0.5 * axis, text, LOCAL, away)
    _, azimuth = one.coordinates
    radius = 0.24 if azimuth < 180.0 else 0.16
    view.turn(one.at(radius, np.linspace(0.0, azimuth, 61)), LOCAL)
    view.label(one.at(radius + 0.13, 0.5 * azimuth), "φsc", LOCAL)


FACTS = (
    "i: to where the light comes from; iₛ: its mirror image, Sp in the thesis; s: scattered, d in the thesis",
    "dotted: down to the projections, β₀ of iₛ and β of s",
    "below: the plane of the sample from above; x′ = z × i, or x at normal incidence; y′ = z × x′",
)


def draw_coordinates(path: Path) -> None:
    """A.2 to A.4: from directions to βsc and φsc, over the sample and in its plane."""
    heading = "Coordinates of Harvey and Shack: βsc = |β − β₀| and its azimuth φsc from x′"
    figure = new_figure(9.6, 6.9, heading, FACTS, layout=None)
    for column, (title, those) in enumerate(CONSTRUCTIONS.items()):
        above = figure.add_axes((0.01 + 0.33 * column, 0.57, 0.32, 0.34))
        below = figure.add_axes((0.01 + 0.33 * column, 0.12, 0.32, 0.44))
        above.set(xlim=(-1.3, 1.45), ylim=(-0.65, 1.4), aspect="equal")
        below.set(xlim=(-1.3, 1.45), ylim=(-1.2, 1.4), aspect="equal")
        for axes in (above, below):
            axes.set_axis_off()
        style.put_title(above, title)
        space, plan = View(above, 24.0, -14.0), View(below)
        draw_surroundings(space)
        draw_surroundings(plan)
        names = ("s",) if len(those) == 1 else ("s (a)", "s (b)")
        for one, name in zip(those, names, strict=True):
            draw_projections(space, one)
            draw_directions(space, one, name)
            draw_projections(plan, one, name)
        for line, (one, name) in enumerate(zip(those, names, strict=True)):
            r, a = one.coordinates
            told = f"{name[1:]} βsc = {r:.2f}, φsc = {a:.0f}°".strip()
            below.annotate(told, (0.0, -1.2), (0, -14 * line), textcoords="offset points", color=INK, **CENTRED)
    save(figure, path)
