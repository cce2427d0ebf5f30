"""Scans from files."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError, FormatError
from etendue.formats.own_kind import DIRECTIONS, STAGES
from etendue.formats.rt300s import is_rt300s, read_rt300s
from etendue.formats.scans_csv import ERROR, read_columns, read_remarks
from etendue.quantities.arguments import described, require, require_number, require_path
from etendue.quantities.bsdf_directions import direction
from etendue.scatter.scans.goniometer import bsdf_of_flux, detector_direction, incident_direction
from etendue.scatter.scans.scans import Scans

Array = npt.NDArray[np.float64]

SAME = 1e-3
"""By which two statements of a solid angle may differ, relative to it."""

SHADOW = 7.5
"""Angle between detector and light [°] below which the one is in the way of the other."""


def read_scans(
    paths: Sequence[str | os.PathLike[str]],
    *,
    incident_flux: str | os.PathLike[str] | None = None,
    solid_angle: float | None = None,
    reflectance: float | None = None,
    transmittance: float | None = None,
    blank: str | os.PathLike[str] | None = None,
) -> Scans:
    r"""Read scans from files, all of one sample.

    Values below 0, as noise about a dark level has them, stay as they are.

    Parameters
    ----------
    paths : sequence of path
        Each with the columns theta_i, phi_i, theta_s, phi_s [°] and bsdf [1/sr]: of the direction to where the light comes
        from and of the detector, azimuths from the x axis of the sample, θ from the normal of the side that the light meets:
        transmitted light has theta_s above 90°; or alpha, beta, gamma, delta [°] and flux, of the
        stages. A column standard_error may follow, in the unit of the values. Or workbooks (.xls) of the goniometer
        RT-300S, whose signal is π f |cos θ|; positions within `SHADOW` of the light, where the detector stands in its way,
        are left out.
    incident_flux : path, optional
        For files of stages: a file of the same columns, whose mean flux is that on the sample.
    solid_angle : float, optional
        For files of stages: of the aperture [sr].
    reflectance, transmittance : float, optional
        Of an integrating sphere.
    blank : path, optional
        For workbooks: of the same positions without a sample, subtracted.

    Raises
    ------
    FormatError, OSError
        If a file cannot be read.
    ArgumentError
        If files of stages come without incident flux and solid angle, some files have standard errors and others none, or
        values are impossible.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "scan.csv"
    ...     _ = path.write_text("theta_i,phi_i,theta_s,phi_s,bsdf\n30,180,30,0,2.5\n30,180,20,0,0.4\n")
    ...     read_scans([path]).values.tolist()
    [2.5, 0.4]
    """
    wanted = "a list of paths, also of one file: [path]"
    if isinstance(paths, str | bytes | os.PathLike):
        raise ArgumentError(f"read_scans: paths is {described(paths)}; give {wanted}.")
    require(paths, Iterable, "read_scans: paths", wanted)
    paths = list(paths)
    for path in paths:
        require_path(path, "read_scans: one of the paths")
    for name, other in (("incident_flux", incident_flux), ("blank", blank)):
        if other is not None:
            require_path(other, f"read_scans: {name}", "the path of a file, or None")
    if solid_angle is not None:
        require_number(solid_angle, "read_scans: solid_angle", "that of the aperture in sr, or None")
    if not paths:
        raise ArgumentError("read_scans: no file of scans is given")
    incident: list[Array] = []
    scattered: list[Array] = []
    values: list[Array] = []
    errors: list[Array | None] = []
    for path in paths:
        if is_rt300s(Path(path)):
            i, s, f = _workbook(Path(path), None if blank is None else Path(blank))
            for kept, part in ((incident, i), (scattered, s), (values, f)):
                kept.append(part)
            errors.append(None)
            continue
        columns = read_columns(Path(path), (DIRECTIONS, STAGES))
        error = columns.get(ERROR)
        if DIRECTIONS[0] in columns:
            _check_angles(Path(path), columns)
            i = direction(columns["theta_i"], columns["phi_i"])
            s = direction(columns["theta_s"], columns["phi_s"])
            f = columns["bsdf"]
        else:
            if incident_flux is None or solid_angle is None:
                raise ArgumentError(f"{path} holds stages and fluxes: state the incident flux and the solid angle too")
            _require_same(Path(path), solid_angle)
            arriving = float(read_columns(Path(incident_flux), (STAGES,))["flux"].mean())
            stages = [columns[name] for name in STAGES[:4]]
            i, s = incident_direction(stages[2], stages[3]), detector_direction(*stages)
            f = bsdf_of_flux(columns["flux"], arriving, solid_angle=solid_angle, direction=s)
            error = None if error is None else bsdf_of_flux(error, arriving, solid_angle=solid_angle, direction=s)
        incident.append(i)
        scattered.append(s)
        values.append(f)
        errors.append(error)
    whole = _all_or_none([Path(path) for path in paths], errors)
    return Scans(
        np.concatenate(incident),
        np.concatenate(scattered),
        np.concatenate(values),
        np.concatenate([error for error in errors if error is not None]) if whole else None,
        reflectance,
        transmittance,
    )


def _all_or_none(paths: Sequence[Path], errors: Sequence[Array | None]) -> bool:
    """Whether standard errors are known; refuses files of which only some have them."""
    known = [error is not None for error in errors]
    if any(known) and not all(known):
        one, other = paths[known.index(True)], paths[known.index(False)]
        raise ArgumentError(
            f"{one} has standard errors and {other} has none: give a column {ERROR} in all files, or in none, since fits "
            "weigh all values by their errors"
        )
    return all(known)


def _require_same(path: Path, solid_angle: float) -> None:
    """Refuse a file that says another solid angle than was stated."""
    said = read_remarks(path).get("solid_angle")
    try:
        own = solid_angle if said is None else float(said)
    except ValueError:
        own = math.nan
    if not abs(own - solid_angle) <= SAME * solid_angle:
        found = f"{str(said)[:40]} sr, and {solid_angle:g} sr is stated"
        raise FormatError(path, "# solid_angle", found, "State the solid angle of this file, or mend its line.")


def _check_angles(path: Path, columns: dict[str, Array]) -> None:
    """Refuse light that does not meet the front, and angles from the normal that there are not."""
    for name, last, advice in (
        ("theta_i", 90.0, "θ of the incident light is counted from the normal of the side that it meets: below 90°."),
        ("theta_s", 180.0, "θ of the detector is up to 90°, of transmitted light up to 180°."),
    ):
        theta = columns[name]
        # A negative angle is on the other side of the normal.
        wrong = (np.abs(theta) > last) | ((np.abs(theta) == 90.0) & (name == "theta_i"))
        if wrong.any():
            at = int(np.argmax(wrong))
            raise FormatError(path, f"row {at + 1}, {name}", f"an angle of {theta[at]:g}°", advice)


def _workbook(path: Path, blank: Path | None) -> tuple[Array, Array, Array]:
    """Incident and scattered directions and f of a workbook of the RT-300S.

    Light comes from azimuth 180°. The instrument's azimuth of −90° with a positive angle of the receiver, and +90° with a
    negative one, lie on the specular side.
    """
    columns = read_rt300s(path)
    angles = [np.round(columns[name], 6) for name in ("azimuth", "incidence", "receive")]
    signal = columns["rt"]
    if blank is not None:
        bare = read_rt300s(blank)
        there = np.column_stack([np.round(bare[name], 6) for name in ("azimuth", "incidence", "receive")])
        known = {tuple(row): value for row, value in zip(there.tolist(), bare["rt"].tolist(), strict=True)}
        wanted = [tuple(row) for row in np.column_stack(angles).tolist()]
        missing = [row for row in wanted if row not in known]
        if missing:
            raise FormatError(
                blank,
                "positions",
                f"none at {missing[0]}",
                f"A blank scan has all positions of {path}.",
            )
        signal = signal - np.array([known[row] for row in wanted])
    azimuth, incidence, receive = angles
    incident = direction(incidence, 180.0)
    scattered = direction(np.abs(receive), azimuth + np.where(receive < 0.0, 270.0, 90.0))
    lit = np.einsum("ij,ij->i", incident, scattered) < np.cos(np.radians(SHADOW))
    f = signal / (np.pi * np.abs(scattered[:, 2]))
    return incident[lit], scattered[lit], f[lit]
