"""Scans from files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from etendue.errors import ArgumentError, FormatError
from etendue.formats.scans_csv import DIRECTIONS, ERROR, STAGES, read_columns
from etendue.quantities.bsdf_data import direction
from etendue.scatter.scans.goniometer import bsdf_of_flux, detector_direction, incident_direction
from etendue.scatter.scans.scans import Scans


def read_scans(
    paths: Sequence[str | os.PathLike[str]],
    *,
    incident_flux: str | os.PathLike[str] | None = None,
    solid_angle: float | None = None,
    reflectance: float | None = None,
) -> Scans:
    r"""Read scans from CSV files, all of one sample.

    Parameters
    ----------
    paths : sequence of path
        Each with the columns theta_i, phi_i, theta_s, phi_s [°] and bsdf [1/sr]: of the direction to where the light comes
        from and of the detector, azimuths from the x axis of the sample; or alpha, beta, gamma, delta [°] and flux, of the
        stages. A column standard_error may follow, in the unit of the values.
    incident_flux : path, optional
        For files of stages: a file of the same columns, whose mean flux is that on the sample.
    solid_angle : float, optional
        For files of stages: of the aperture [sr].
    reflectance : float, optional
        Of an integrating sphere.

    Raises
    ------
    FormatError, OSError
        If a file cannot be read.
    ArgumentError
        If files of stages come without incident flux and solid angle, or values are impossible.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "scan.csv"
    ...     _ = path.write_text("theta_i,phi_i,theta_s,phi_s,bsdf\n30,180,30,0,2.5\n30,180,20,0,0.4\n")
    ...     read_scans([path]).values.tolist()
    [2.5, 0.4]
    """
    if not paths:
        raise ArgumentError("no file of scans is given")
    incident, scattered, values, errors = [], [], [], []
    for path in paths:
        columns = read_columns(Path(path), (DIRECTIONS, STAGES))
        error = columns.get(ERROR)
        if DIRECTIONS[0] in columns:
            i = direction(columns["theta_i"], columns["phi_i"])
            s = direction(columns["theta_s"], columns["phi_s"])
            f = columns["bsdf"]
        else:
            if incident_flux is None or solid_angle is None:
                raise ArgumentError(f"{path} holds stages and fluxes: state the incident flux and the solid angle too")
            arriving = float(read_columns(Path(incident_flux), (STAGES,))["flux"].mean())
            stages = [columns[name] for name in STAGES[:4]]
            i, s = incident_direction(stages[2], stages[3]), detector_direction(*stages)
            f = bsdf_of_flux(columns["flux"], arriving, solid_angle=solid_angle, direction=s)
            error = None if error is None else bsdf_of_flux(error, arriving, solid_angle=solid_angle, direction=s)
        if (f < 0.0).any():
            at = int(np.argmin(f))
            raise FormatError(
                Path(path), f"row {at + 1}", f"a value of {f[at]:g}", "A BSDF is not below 0: subtract less."
            )
        incident.append(i)
        scattered.append(s)
        values.append(f)
        errors.append(error)
    whole = all(error is not None for error in errors)
    return Scans(
        np.concatenate(incident),
        np.concatenate(scattered),
        np.concatenate(values),
        np.concatenate([error for error in errors if error is not None]) if whole else None,
        reflectance,
    )
