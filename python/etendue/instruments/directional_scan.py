"""`DirectionalScan`: flux in the aperture of a detector at directions of two dimensions, light coming from one."""

from __future__ import annotations

import dataclasses
import functools
import math
import os
from types import NoneType

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, EtendueError, FormatError
from etendue.extras import scipy_part
from etendue.formats.input import as_path
from etendue.formats.output import atomic_output
from etendue.formats.own_kind import DIRECTIONS, POLAR
from etendue.formats.scans_csv import ERROR, read_columns, read_remarks
from etendue.instruments.bench import Bench
from etendue.instruments.goniometer_scan import GoniometerScan, Way, flux_of_unit_bsdf, known_of, read_goniometer_scan
from etendue.instruments.lobe_table import polar_slice
from etendue.quantities.arguments import as_numbers, require, require_number, require_numbers
from etendue.quantities.bsdf_directions import direction, light_from
from etendue.quantities.bsdf_slice import BsdfSlice

Array = npt.NDArray[np.float64]

SAME = 1e-9
"""How far two directions may differ that are one."""

IN_PLANE = 1e-6
"""Sines of azimuths up to which directions lie in the plane of incidence: angles in files have few digits."""


KNOWN = ("incidence", "background", "solid_angle", "shared_rays")
"""What lines say of scans in one plane and in two dimensions alike."""


@dataclasses.dataclass(frozen=True, eq=False)
class DirectionalScan:
    """A scan in two dimensions: flux by direction of the detector, with its standard error.

    Parameters
    ----------
    direction : array, shape (n, 3)
        Of the detector from the middle of the spot, all on one side of the sample; the normal of its front is +z, and light
        comes from azimuth 180°. What the bench shadows is left out.
    flux : array, shape (n,)
        In the aperture, as a share of the flux of the beam, or in any other unit.
    standard_error : array, shape (n,), optional
        Of the flux, in its unit.
    solid_angle : number, optional
        Of the aperture [sr], by which flux becomes a BSDF.
    incidence : number
        Angle of incidence [°].
    background : number
        What the detector shows in the dark, in the unit of the flux: subtracted already.
    bench : Bench, optional
        The instrument.
    shared_rays : int
        Rays that all positions count, so that neighbours err together; 0 if each position has light of its own.
    notes : tuple of str
        What is worth knowing.

    Raises
    ------
    ArgumentError
        If lengths differ, a direction is no unit vector or stands twice, or a value is not finite.

    Examples
    --------
    >>> scan = DirectionalScan(direction([28.0, 30.0, 32.0], 0.0), [1e-4, 5e-4, 1e-4], solid_angle=6.25e-4, incidence=30)
    >>> scan.bsdf.round(3).tolist(), scan.way
    ([0.181, 0.924, 0.189], 'reflected')
    """

    direction: Array
    flux: Array
    standard_error: Array | None = None
    _: dataclasses.KW_ONLY
    solid_angle: float | None = None
    incidence: float = 0.0
    background: float = 0.0
    bench: Bench | None = None
    shared_rays: int = 0
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        arms = as_numbers(self.direction, "DirectionalScan: direction", "unit vectors, shape (n, 3)", copy=True)
        if arms.ndim != 2 or arms.shape[1] != 3 or not len(arms):
            raise ArgumentError(f"directions have shape (n, 3), not {arms.shape}")
        if not (np.abs(np.linalg.norm(arms, axis=1) - 1.0) < SAME).all():
            raise ArgumentError("directions of a detector are unit vectors")
        if not ((arms[:, 2] > 0.0).all() or (arms[:, 2] < 0.0).all()):
            raise ArgumentError("a scan is of light that is reflected, or of light that is transmitted: split it")
        object.__setattr__(self, "direction", arms)
        for name in ("flux", "standard_error"):
            given = getattr(self, name)
            if given is None and name == "standard_error":
                continue
            values = as_numbers(given, f"DirectionalScan: {name}", "a row of numbers", copy=True)
            if values.shape != arms.shape[:1]:
                raise ArgumentError(f"{name} has shape {values.shape}; there are {len(arms)} directions")
            if not np.isfinite(values).all():
                at = int(np.argmin(np.isfinite(values)))
                raise ArgumentError(
                    f"{name}: value {at + 1} is {values[at]}; leave out directions that were not measured"
                )
            object.__setattr__(self, name, values)
        for held in (self.direction, self.flux, self.standard_error):
            if held is not None:
                held.flags.writeable = False
        rounded = np.unique(np.round(arms, 9), axis=0)
        if len(rounded) < len(arms):
            raise ArgumentError(f"{len(arms) - len(rounded)} directions stand twice; give each once")
        if self.standard_error is not None and (self.standard_error < 0.0).any():
            raise ArgumentError("standard errors are not negative")
        require(self.bench, (Bench, NoneType), "DirectionalScan: bench", "the `bench` of a ScatterGoniometer, or None")
        require_numbers(self, "incidence", "background")
        require_numbers(self, "solid_angle", none=True)
        if not 0.0 <= self.incidence < 90.0:
            raise ArgumentError(f"an angle of incidence of {self.incidence:g}°; give 0 to below 90°")
        if self.solid_angle is not None and not 0.0 < self.solid_angle < math.inf:
            raise ArgumentError(f"a solid angle of {self.solid_angle} sr; give more than 0")
        if not 0.0 <= self.background < math.inf:
            raise ArgumentError(f"a background of {self.background}; give 0 or more")
        if self.shared_rays < 0:
            raise ArgumentError(f"shared_rays is {self.shared_rays}; give 0 or more")

    def __repr__(self) -> str:
        """Positions, and what was measured."""
        return f"DirectionalScan({self.flux.size} positions, {self.way} at {self.incidence:g}°)"

    @property
    def way(self) -> Way:
        """Where the light that is measured goes."""
        return "transmitted" if self.behind else "reflected"

    @property
    def behind(self) -> bool:
        """Whether it is transmitted."""
        return bool(self.direction[0, 2] < 0.0)

    @property
    def incident(self) -> Array:
        """To where the light comes from, shape (3,)."""
        return light_from(self.incidence, 180.0)

    @property
    def regular(self) -> Array:
        """Where light goes that is mirrored, or straight on, shape (3,)."""
        return direction(self.incidence, 0.0, behind=self.behind)

    @property
    def cosine(self) -> Array:
        """|cos θₛ| of the detector, shape (n,)."""
        return np.asarray(np.abs(self.direction[:, 2]))

    @functools.cached_property
    def spacing(self) -> Array:
        """Angle from each position to the nearest other one [°]; needs SciPy."""
        tree = scipy_part("spatial").cKDTree(self.direction)
        chord = tree.query(self.direction, k=2)[0][:, 1] if self.flux.size > 1 else np.full(1, 2.0)
        return np.asarray(np.degrees(2.0 * np.arcsin(np.clip(0.5 * chord, 0.0, 1.0))))

    @property
    def bsdf(self) -> Array:
        """F [1/sr] by eq. 5.1: flux over solid angle and |cos θₛ|, if the flux is a share of that of the beam.

        Raises
        ------
        ArgumentError
            If the solid angle is not known.
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

    @functools.cached_property
    def spread(self) -> tuple[float, float]:
        """Angles that the positions span: in the plane of incidence, and across it [°]."""
        x, y, z = self.direction.T
        along = np.degrees(np.arctan2(x, np.abs(z)))
        return float(np.ptp(along)), float(np.ptp(np.degrees(np.arcsin(np.clip(y, -1.0, 1.0)))))

    @functools.cached_property
    def gaps(self) -> int:
        """Positions that are missing in an even window: holes whose neighbours on both sides of both axes are there."""
        step = float(np.quantile(self.spacing, 0.1))
        dense = self.direction[self.spacing < 1.5 * step]
        x, y, z = dense.T
        across = np.round(np.degrees(np.arcsin(np.clip(y, -1.0, 1.0))) / step)
        along = np.degrees(np.arctan2(x, np.abs(z)))
        at = np.column_stack([np.round((along - along.min()) / step), across - across.min()]).astype(int)
        there = np.zeros(at.max(axis=0) + 1, bool)
        there[at[:, 0], at[:, 1]] = True
        before = [np.logical_or.accumulate(there, axis) for axis in (0, 1)]
        after = [np.flip(np.logical_or.accumulate(np.flip(there, axis), axis), axis) for axis in (0, 1)]
        return int((~there & before[0] & before[1] & after[0] & after[1]).sum())

    @property
    def regular_share(self) -> float:
        """What is mirrored is in the flux of a scan."""
        return 0.0

    def extent(self, cell: float) -> dict[str, float]:
        """Detail of width `cell` [°] and distance of the farthest position, in direction cosines."""
        require_number(cell, "DirectionalScan.extent: cell", "an angle in °")
        off = self.direction[:, :2] - self.regular[:2]
        fine = np.radians(float(cell)) * abs(float(self.regular[2]))
        return {"cell": float(fine), "farthest": float(np.hypot(*off.T).max())}

    def slice(self) -> BsdfSlice:
        """As a slice of a table, on a polar grid about the regular direction; linear between positions."""
        interpolate = scipy_part("interpolate")
        error = self.bsdf_error
        both = self.bsdf[:, None] if error is None else np.column_stack([self.bsdf, error])
        between = interpolate.LinearNDInterpolator(self.direction[:, :2], np.maximum(both, 0.0))

        def f(to: Array) -> tuple[Array, Array | None]:
            found = between(to[:, :2])
            return found[:, 0], None if error is None else found[:, 1]

        step = float(np.quantile(self.spacing, 0.1))
        return polar_slice(f, self.incident, behind=self.behind, **self.extent(0.5 * step))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a CSV file: theta_s and phi_s [°], flux and standard error; what else is known in lines with ``#``.

        θ is the angle from +z: beyond 90° for light that is transmitted.

        Raises
        ------
        OSError
            If it cannot be written; it appears whole or not at all.

        Examples
        --------
        >>> from pathlib import Path
        >>> from tempfile import TemporaryDirectory
        >>> with TemporaryDirectory() as folder:
        ...     path = Path(folder) / "scan.csv"
        ...     DirectionalScan(direction([29.0, 30.0], 0.0), [0.25, 0.5], solid_angle=1e-3).save(path)
        ...     back = read_directional_scan(path)
        >>> back.flux.tolist(), back.solid_angle
        ([0.25, 0.5], 0.001)
        """
        remarks: dict[str, object] = {"incidence": self.incidence, "background": self.background}
        if self.solid_angle is not None:
            remarks["solid_angle"] = self.solid_angle
        if self.shared_rays:
            remarks["shared_rays"] = self.shared_rays
        if self.bench is not None:
            remarks |= self.bench.remarks()
        theta, phi = angles_of(self.direction)
        error = [] if self.standard_error is None else [self.standard_error]
        names = [*POLAR, *([ERROR] if error else [])]
        rows = [",".join(map(repr, map(float, row))) for row in zip(theta, phi, self.flux, *error, strict=True)]
        lines = [*(f"# {key} = {value}" for key, value in remarks.items()), ",".join(names), *rows]
        with atomic_output(path) as temporary:
            temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def angles_of(directions: Array) -> tuple[Array, Array]:
    """Angle from +z and azimuth [°] of unit vectors of shape (n, 3); 60 and not 59.99999999999999.

    Examples
    --------
    >>> [a.tolist() for a in angles_of(direction([60.0], 90.0))]
    [[60.0], [90.0]]
    """
    x, y, z = directions.T
    return (
        np.round(np.degrees(np.arctan2(np.hypot(x, y), z)), 12),
        np.round(np.degrees(np.arctan2(y, x) % (2.0 * np.pi)), 12),
    )


def read_directional_scan(path: str | os.PathLike[str]) -> DirectionalScan:
    r"""Read a scan in two dimensions from a CSV file.

    Parameters
    ----------
    path : path
        With the columns theta_s, phi_s [°] and flux, as `DirectionalScan.save` writes them, light coming from azimuth 180°;
        or theta_i, phi_i, theta_s, phi_s [°] and bsdf [1/sr] of a single incidence. A column standard_error may follow.
        Lines ``# solid_angle = …``, ``# beam_diameter = …`` and so on say what else is known.

    Raises
    ------
    FormatError, OSError
        If the file cannot be read; names the line.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "scan.csv"
    ...     _ = path.write_text("# incidence = 30\ntheta_s;phi_s;flux\n30;0;3\n30;2;4\n")
    ...     read_directional_scan(path)
    DirectionalScan(2 positions, reflected at 30°)
    """
    path = as_path(path)
    columns = read_columns(path, (DIRECTIONS, POLAR))
    remarks = read_remarks(path)
    known = {key: value for key, value in known_of(path, remarks).items() if key in KNOWN}
    error = columns.get(ERROR)
    turned, theta = columns["phi_s"], columns["theta_s"]
    if DIRECTIONS[0] in columns:
        if np.ptp(columns["theta_i"]) > 0.0 or np.ptp(columns["phi_i"]) > 0.0:
            raise FormatError(path, "column theta_i", "several incidences", "A scan has one: split the file.")
        turned = turned - columns["phi_i"] + 180.0
        known = {"solid_angle": 1.0} | known | {"incidence": float(columns["theta_i"][0])}
        per = np.abs(np.cos(np.radians(theta))) * float(known["solid_angle"])  # type: ignore[arg-type]
        flux, error = columns["bsdf"] * per, None if error is None else error * per
    else:
        flux = columns["flux"]
    try:
        bench = Bench.from_remarks(remarks)
        return DirectionalScan(direction(theta, turned), flux, error, bench=bench, **known)  # type: ignore[arg-type]
    except (EtendueError, ValueError) as found:
        raise FormatError(path, "values", str(found), "Mend the file.") from None


def read_scan(path: str | os.PathLike[str]) -> GoniometerScan | DirectionalScan:
    """Read a scan in one plane or in two dimensions, whichever the columns of a file say that it is.

    Raises
    ------
    FormatError, OSError
        If the file cannot be read; names the line.
    """
    path = as_path(path)
    columns = read_columns(path, (("angle", "flux"), DIRECTIONS, POLAR))
    if "angle" in columns:
        return read_goniometer_scan(path)
    if "theta_i" not in columns:
        return read_directional_scan(path)
    turned = np.sin(np.radians(columns["phi_s"] - columns["phi_i"])) * np.sin(np.radians(columns["theta_s"]))
    return read_directional_scan(path) if (np.abs(turned) > IN_PLANE).any() else read_goniometer_scan(path)
