"""`GoniometerScan`: flux in the aperture of a detector that passes in front of a sample, or of the bare beam."""

from __future__ import annotations

import dataclasses
import difflib
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, FormatError
from etendue.formats.input import as_path
from etendue.formats.output import atomic_output
from etendue.formats.own_kind import DIRECTIONS, POSITIONS
from etendue.formats.scans_csv import ERROR, read_columns, read_remarks
from etendue.instruments.positions import Plane, detector_directions
from etendue.instruments.ring_sum import sum_of_rings
from etendue.quantities.arguments import as_numbers, require_known, require_numbers
from etendue.quantities.bsdf_directions import light_from
from etendue.scatter.scans.scans import Scans

Array = npt.NDArray[np.float64]
Way = Literal["transmitted", "reflected"]

FINE = 16
"""Parts of a step between positions in which the total scatter is added up."""

REMARKS = ("incidence", "background", "solid_angle", "shared_rays", "way", "plane", "sample")
"""What lines of a file may say of a scan; others are remarks of people."""

ALIKE = 0.8
"""How alike a line is to one of these to be a slip of it, and no remark."""

SAME_STEP = 1e-3
"""By which steps may differ, relative to the smallest, and still be the same: angles in files have few digits."""


def flux_of_unit_bsdf(solid_angle: float | None, cosine: Array) -> Array:
    """Flux in the aperture, as a share of that of the beam, for f = 1/sr: solid angle · |cos θₛ|, eq. 5.1, shape (n,).

    Parameters
    ----------
    solid_angle : number or None
        Of the aperture [sr]; None if it is not known.
    cosine : array, shape (n,)
        |cos θₛ| of the detector.

    Raises
    ------
    ArgumentError
        If the solid angle is not known, or the detector stood in the plane of the sample.

    Examples
    --------
    >>> flux_of_unit_bsdf(1e-3, np.array([1.0, 0.5])).tolist()
    [0.001, 0.0005]
    """
    if solid_angle is None:
        raise ArgumentError("the solid angle of the aperture is not known, so that flux is no BSDF: state solid_angle")
    if (cosine < 1e-9).any():
        raise ArgumentError("a detector in the plane of the sample measures no BSDF")
    return np.asarray(solid_angle * cosine)


@dataclasses.dataclass(frozen=True, eq=False)
class GoniometerScan:
    """A scan in one plane: flux by angle of the detector, with its standard error.

    Parameters
    ----------
    angle : array, shape (n,)
        Of the detector [°], increasing: in the plane of incidence from the normal of the sample, positive on the side to
        which the light goes; across it from the regular direction. Without a sample from the beam.
    flux : array, shape (n,)
        In the aperture, as a share of the flux of the beam, or in any other unit.
    standard_error : array, shape (n,), optional
        Of the flux, in its unit.
    solid_angle : number, optional
        Of the aperture [sr], by which flux becomes a BSDF.
    incidence : number
        Angle of incidence [°].
    way : {"transmitted", "reflected"}
        Where the light that is measured goes.
    plane : {"in-plane", "cross-plane"}
        In which the detector moves.
    background : number
        What the detector shows in the dark, in the unit of the flux: subtracted already.
    sample : bool
        Whether there was a sample in the beam.
    shared_rays : int
        Rays that all positions count, so that neighbours err together; 0 if each position has light of its own.
    notes : tuple of str
        What is worth knowing.

    Raises
    ------
    ArgumentError
        If lengths differ, angles do not increase, or a value is not finite.

    Examples
    --------
    >>> scan = GoniometerScan([-1.0, 0.0, 1.0], [1e-4, 5e-4, 1e-4], solid_angle=6.25e-4)
    >>> scan.bsdf.round(3).tolist()
    [0.16, 0.8, 0.16]
    """

    angle: Array
    flux: Array
    standard_error: Array | None = None
    _: dataclasses.KW_ONLY
    solid_angle: float | None = None
    incidence: float = 0.0
    way: Way = "transmitted"
    plane: Plane = "in-plane"
    background: float = 0.0
    sample: bool = True
    shared_rays: int = 0
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("angle", "flux", "standard_error"):
            given = getattr(self, name)
            if given is None and name == "standard_error":
                continue
            values = as_numbers(given, f"GoniometerScan: {name}", "a row of numbers", copy=True)
            if values.ndim != 1 or values.shape != np.shape(self.angle) or not values.size:
                raise ArgumentError(
                    f"{name} has shape {values.shape}, the angles {np.shape(self.angle)}; give one for each"
                )
            if not np.isfinite(values).all():
                at = int(np.argmin(np.isfinite(values)))
                raise ArgumentError(
                    f"{name}: value {at + 1} is {values[at]}; leave out positions that were not measured"
                )
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        if (np.diff(self.angle) <= 0.0).any():
            at = int(np.argmax(np.diff(self.angle) <= 0.0))
            raise ArgumentError(f"angles increase; after {self.angle[at]:g}° comes {self.angle[at + 1]:g}°")
        if self.standard_error is not None and (self.standard_error < 0.0).any():
            raise ArgumentError("standard errors are not negative")
        require_numbers(self, "incidence", "background")
        require_numbers(self, "solid_angle", none=True)
        if not 0.0 <= self.incidence < 90.0:
            raise ArgumentError(f"incidence is {self.incidence:g}°; light meets a sample at 0 to below 90°")
        require_known(self.way, get_args(Way), "way")
        require_known(self.plane, get_args(Plane), "plane")
        if self.solid_angle is not None and not 0.0 < self.solid_angle < math.inf:
            raise ArgumentError(f"a solid angle of {self.solid_angle} sr; give more than 0")
        if not 0.0 <= self.background < math.inf:
            raise ArgumentError(f"a background of {self.background}; give 0 or more")
        if self.shared_rays < 0:
            raise ArgumentError(f"shared_rays is {self.shared_rays}; give 0 or more")

    def __repr__(self) -> str:
        """Positions, and what was measured."""
        where = f"{self.angle.size} positions from {self.angle[0]:g} to {self.angle[-1]:g}°"
        what = f"{self.way} at {self.incidence:g}°, {self.plane}" if self.sample else "no sample"
        return f"GoniometerScan({where}, {what})"

    @property
    def regular(self) -> float:
        """The angle at which light arrives that is mirrored, or goes straight on [°]."""
        return self.incidence if self.plane == "in-plane" and self.sample else 0.0

    @property
    def step(self) -> float:
        """Smallest step between positions [°]."""
        return float(np.diff(self.angle).min()) if self.angle.size > 1 else 0.0

    @property
    def gaps(self) -> tuple[tuple[float, float], ...]:
        """Pairs of neighbouring positions between which others are missing [°]."""
        steps = np.diff(self.angle)
        wide = np.flatnonzero(steps > (1.0 + SAME_STEP) * self.step)
        return tuple((float(self.angle[at]), float(self.angle[at + 1])) for at in wide)

    @property
    def cosine(self) -> Array:
        """|cos θₛ| of the detector, shape (n,); 1 without a sample."""
        if not self.sample:
            return np.ones(self.angle.shape)
        turned = 1.0 if self.plane == "in-plane" else np.cos(np.radians(self.incidence))
        return np.asarray(np.abs(np.cos(np.radians(self.angle))) * turned)

    @property
    def bsdf(self) -> Array:
        """F [1/sr] by eq. 5.1: flux over solid angle and |cos θₛ|, if the flux is a share of that of the beam.

        Raises
        ------
        ArgumentError
            If the solid angle is not known, or the detector stood in the plane of the sample.
        """
        return np.asarray(self.flux / flux_of_unit_bsdf(self.solid_angle, self.cosine))

    @property
    def bsdf_error(self) -> Array | None:
        """Standard error of `bsdf`."""
        return (
            None
            if self.standard_error is None
            else np.asarray(self.standard_error / flux_of_unit_bsdf(self.solid_angle, self.cosine))
        )

    @property
    def peak(self) -> float:
        """Largest flux."""
        return float(self.flux.max())

    @property
    def fwhm(self) -> float:
        """Full width at half maximum [°], linear between positions; NaN if the scan ends before.

        Examples
        --------
        >>> GoniometerScan([-2.0, -1.0, 0.0, 1.0, 2.0], [0.0, 1.0, 2.0, 1.0, 0.0]).fwhm
        2.0
        """
        return full_width(self.angle, self.flux)

    @property
    def total_scatter(self) -> float:
        """Total integrated scatter of a lobe that is alike all around the regular direction in direction cosines.

        At normal incidence eq. 5.2, both sides averaged; at others see `sum_of_rings`. One scan cannot tell what the lobe is
        like elsewhere: one that is round in the angle gives up to 1/cosθ times its light, a lobe wider one way less or more.
        Cubic between the positions. Needs the solid angle.
        """
        values = self.bsdf * self.cosine
        if not self.sample:
            return total_scatter(self.angle, values)
        return sum_of_rings(self.angle, lambda at: cubic(self.angle, values, at), self.incidence, self.plane)

    def scans(self) -> Scans:
        """The same as values at pairs of directions, for `Bsdf.from_scans`; light comes from azimuth 180°.

        Values below 0, as noise about a dark level has them, stay: see there.

        Raises
        ------
        ArgumentError
            If it is a scan without a sample, or the solid angle is not known.
        """
        if not self.sample:
            raise ArgumentError("scans for tables are of light that a sample scatters; this one is of the beam alone")
        incident = np.tile(light_from(self.incidence, 180.0), (self.angle.size, 1))
        scattered = detector_directions(self.angle, self.incidence, self.plane, behind=self.way == "transmitted")
        return Scans(incident, scattered, self.bsdf, self.bsdf_error)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a CSV file: angle, flux and standard error, and what else is known in lines that begin with ``#``.

        Raises
        ------
        OSError
            If it cannot be written; it appears whole or not at all.

        Examples
        --------
        >>> from tempfile import TemporaryDirectory
        >>> with TemporaryDirectory() as folder:
        ...     path = Path(folder) / "scan.csv"
        ...     GoniometerScan([-1.0, 0.0], [0.25, 0.5], solid_angle=1e-3).save(path)
        ...     back = read_goniometer_scan(path)
        >>> back.flux.tolist(), back.solid_angle
        ([0.25, 0.5], 0.001)
        """
        remarks: dict[str, object] = {
            "incidence": self.incidence,
            "way": self.way,
            "plane": self.plane,
            "sample": "yes" if self.sample else "no",
            "background": self.background,
        }
        if self.solid_angle is not None:
            remarks["solid_angle"] = self.solid_angle
        if self.shared_rays:
            remarks["shared_rays"] = self.shared_rays
        names = [*POSITIONS, *([ERROR] if self.standard_error is not None else [])]
        columns = [self.angle, self.flux, *([self.standard_error] if self.standard_error is not None else [])]
        rows = [",".join(repr(float(value)) for value in row) for row in zip(*columns, strict=True)]
        lines = [*(f"# {key} = {value}" for key, value in remarks.items()), ",".join(names), *rows]
        with atomic_output(path) as temporary:
            temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def read_goniometer_scan(path: str | os.PathLike[str]) -> GoniometerScan:
    r"""Read a scan in one plane from a CSV file.

    Parameters
    ----------
    path : path
        With the columns angle [°] and flux, as `GoniometerScan.save` writes them; or theta_i, phi_i, theta_s, phi_s [°] and
        bsdf [1/sr] of a single incidence, all directions in its plane. A column standard_error may follow. Lines
        ``# solid_angle = …`` and so on say what else is known.

    Raises
    ------
    FormatError, OSError
        If the file cannot be read; names the line.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "scan.csv"
    ...     _ = path.write_text("angle;flux\n0.1;3\n0;4\n")
    ...     read_goniometer_scan(path).flux.tolist()
    [4.0, 3.0]
    """
    path = as_path(path)
    columns = read_columns(path, (POSITIONS, DIRECTIONS))
    known = known_of(path, read_remarks(path))
    if DIRECTIONS[0] in columns:
        incidence = float(columns["theta_i"][0])
        if np.ptp(columns["theta_i"]) > 0.0 or np.ptp(columns["phi_i"]) > 0.0:
            raise FormatError(
                path, "column theta_i", "several incidences", "A scan in one plane has one: split the file."
            )
        # Light goes on to the azimuth opposite to where it comes from.
        turned = np.radians(columns["phi_s"] - columns["phi_i"])
        theta = np.where(columns["theta_s"] > 90.0, 180.0 - columns["theta_s"], columns["theta_s"])
        # Light along the normal has no plane of incidence: the first direction says which plane it is.
        oblique = np.abs(theta) > 0.0
        if incidence == 0.0 and oblique.any():
            turned = turned - turned[oblique][0]
        if (np.abs(np.sin(turned[oblique])) > 1e-6).any():
            raise FormatError(
                path, "column phi_s", "directions outside the plane of incidence", "Give one plane alone."
            )
        behind = bool((columns["theta_s"] > 90.0).all())
        if not behind and (columns["theta_s"] > 90.0).any():
            raise FormatError(
                path, "column theta_s", "reflected and transmitted light", "A scan is of one: split the file."
            )
        if known.get("way", way := "transmitted" if behind else "reflected") != way:
            raise FormatError(path, "# way", f"{known['way']}, but the directions are of {way} light", "Mend the line.")
        angle = -np.sign(np.cos(turned) + (theta == 0.0)) * theta
        flux = columns["bsdf"] * np.cos(np.radians(theta))
        error = columns[ERROR] * np.cos(np.radians(theta)) if ERROR in columns else None
        known = {"solid_angle": 1.0, "way": way} | known | {"incidence": incidence}
    else:
        angle, flux, error = columns["angle"], columns["flux"], columns.get(ERROR)
    order = np.argsort(angle, kind="stable")
    twice = np.flatnonzero(np.diff(angle[order]) == 0.0)
    if twice.size:
        raise FormatError(path, "angles", f"{angle[order][twice[0]]:g}° twice", "Give each position once.")
    return GoniometerScan(angle[order], flux[order], None if error is None else error[order], **known)  # type: ignore[arg-type]


def known_of(path: Path, remarks: Mapping[str, str]) -> dict[str, object]:
    """What lines of a file say of a scan, by the names of `GoniometerScan`.

    Raises
    ------
    FormatError
        If a value is none that is possible.
    """
    found: dict[str, object] = {}
    for key in sorted(remarks.keys() - set(REMARKS)):
        (near, *_) = (*difflib.get_close_matches(key, REMARKS, 1, ALIKE), None)
        if near is not None:
            raise FormatError(path, f"# {key[:40]}", "no such line", f"Did you mean '# {near} = …'?")
    for key in ("incidence", "background", "solid_angle"):
        if key in remarks:
            try:
                found[key] = float(remarks[key])
            except ValueError:
                raise FormatError(path, f"# {key}", f"{remarks[key][:40]!r} is no number", "Mend the line.") from None
            if key == "incidence" and not 0.0 <= float(remarks[key]) < 90.0:
                raise FormatError(path, f"# {key}", f"{remarks[key][:40]}°", "Light meets a sample at 0 to below 90°.")
    if "shared_rays" in remarks:
        if not remarks["shared_rays"].isdecimal():
            told = f"{remarks['shared_rays'][:40]!r} is no number of rays"
            raise FormatError(path, "# shared_rays", told, "Mend the line.")
        found["shared_rays"] = int(remarks["shared_rays"])
    for key, choices in (("way", get_args(Way)), ("plane", get_args(Plane)), ("sample", ("yes", "no"))):
        if key in remarks:
            if remarks[key] not in choices:
                raise FormatError(path, f"# {key}", f"{remarks[key][:40]!r}", f"It is one of {', '.join(choices)}.")
            found[key] = remarks[key] == "yes" if key == "sample" else remarks[key]
    return found


def summit(angle: Array, values: Array) -> float:
    """The largest value of a smooth lobe, between positions: a parabola through the logarithms of the three highest.

    Exact for a Gaussian wherever its middle is. At an end of the positions, or beside 0, the largest value itself.

    Examples
    --------
    >>> angle = np.arange(-1.0, 1.01, 0.1)
    >>> round(summit(angle, np.exp(-3.0 * (angle - 0.04) ** 2)), 6)
    1.0
    """
    k = int(np.argmax(values))
    if not 0 < k < values.size - 1 or values[k - 1 : k + 2].min() <= 0.0:
        return float(values[k])
    parabola = np.polyfit(angle[k - 1 : k + 2] - angle[k], np.log(values[k - 1 : k + 2]), 2)
    if not parabola[0] < 0.0:
        return float(values[k])
    return float(np.exp(parabola[2] - parabola[1] ** 2 / (4.0 * parabola[0])))


def full_width(angle: Array, values: Array) -> float:
    """Full width at half of `summit`, linear between positions; NaN if there is no half on both sides.

    Examples
    --------
    >>> full_width(np.array([-1.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]))
    1.0
    """
    top = int(np.argmax(values))
    half = 0.5 * summit(angle, values)
    ends = []
    for order in (slice(top, None, -1) if top else slice(0, 1), slice(top, None)):
        a, v = angle[order], values[order]
        below = np.flatnonzero(v < half)
        if not below.size:
            return float("nan")
        k = int(below[0])
        ends.append(float(a[k - 1] + (a[k] - a[k - 1]) * (v[k - 1] - half) / (v[k - 1] - v[k])))
    return ends[1] - ends[0]


def total_scatter(angle: Array, values: Array) -> float:
    """π ∫ f cosθ |sin θ| dθ over both sides of a lobe (eq. 5.2 for the mean of both), `values` being f cosθ.

    Cubic between the positions: the rule of trapezia is off by h² f(0)/12 at the middle, 2 % of a lobe of 0.5° in steps of
    0.1°.

    Examples
    --------
    >>> angle = np.arange(-90.0, 90.01, 1.0)
    >>> round(total_scatter(angle, np.cos(np.radians(angle)) / np.pi), 5)
    1.0
    """
    if angle.size < 2:
        return 0.0
    inner = np.arange(FINE) / FINE
    x = np.append((angle[:-1, None] + np.diff(angle)[:, None] * inner).ravel(), angle[-1])
    y = cubic(angle, values, x)
    return float(np.pi * np.trapezoid(y * np.abs(np.sin(np.radians(x))), np.radians(x)))


def cubic(angle: Array, values: Array, at: Array) -> Array:
    """Values between positions by cubics with the slopes of `numpy.gradient`.

    Examples
    --------
    >>> angle = np.arange(5.0)
    >>> cubic(angle, angle**2, np.array([1.5, 2.0])).tolist()
    [2.25, 4.0]
    """
    slope = np.gradient(values, angle)
    k = np.clip(np.searchsorted(angle, at, side="right") - 1, 0, angle.size - 2)
    h = angle[k + 1] - angle[k]
    u = (at - angle[k]) / h
    return np.asarray(
        values[k] * (1 + 2 * u) * (1 - u) ** 2
        + slope[k] * h * u * (1 - u) ** 2
        + values[k + 1] * u * u * (3 - 2 * u)
        + slope[k + 1] * h * u * u * (u - 1)
    )
