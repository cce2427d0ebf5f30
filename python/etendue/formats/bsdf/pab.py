"""Text of PAB's goniophotometers ("Mountain"): one incidence a file, single directions with their values."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from etendue.errors import FormatError
from etendue.formats.bsdf.bsdf_format import BsdfFormat
from etendue.formats.bsdf.points import below_zero, slices_of
from etendue.formats.bsdf.tokens import ADVICE, ended_lines
from etendue.formats.rays.text_rows import number, whole
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.report import Complaint

UPWARDS = 90.0
"""Azimuth of the upwards direction of a sample [°]: y, as in the XML of Radiance, which is made of such files."""

HORIZON = 1e-3
"""Cosine below which the intensity is no longer divided by it."""


def recognise(head: bytes) -> bool:
    """By the line that names the columns."""
    return re.search(rb"^#\s*format\s*:\s*theta\s+phi\s+(DSF|B[SRT]DF)", head, re.MULTILINE | re.IGNORECASE) is not None


def read(path: Path) -> BsdfData:
    """Read one incidence; files of several are read together by `read_bsdf`.

    Directions are away from the sample, θ from the normal of its front, beyond 90° behind it, so that the mirrored direction
    has the azimuth φ + 180°. `#upphi` is the azimuth of the upwards direction of the sample, 0 if it is not stated, and
    becomes the y axis. DSF is f cosθ. Of three tristimulus values the second is read.
    """
    lines = ended_lines(path)
    keys: dict[str, str] = {}
    rows: list[list[float]] = []
    for at, line in enumerate(lines, 1):
        content = line.strip()
        if content.startswith("#"):
            body = content.lstrip("# \t")
            key, _, value = body.partition(":") if re.match(r"[\w ]+:", body) else body.partition(" ")
            keys.setdefault(key.strip().casefold(), value.strip().strip('"'))
        elif content:
            rows.append(_row(path, at, content, len(rows[0]) if rows else None))
    if not rows:
        raise FormatError(path, f"line {len(lines)}", "no directions follow", ADVICE)
    stated = whole(keys.get("datapoints_in_file", "").split()[0]) if keys.get("datapoints_in_file") else None
    if stated is not None and stated != len(rows):
        raise FormatError(path, "datapoints_in_file", f"{stated} are stated, {len(rows)} stand there", ADVICE)
    quantity = keys.get("format", "").split()[2].upper()
    theta, phi = _incidence(path, keys)
    table = np.array(rows)
    complaints: list[Complaint] = []
    colours = table.shape[1] - 2
    if colours not in (1, 3):
        raise FormatError(path, "first row", f"{colours} values in a row", "étendue reads one value, or X, Y and Z.")
    f = table[:, 2] if colours == 1 else table[:, 3]
    if colours != 1:
        complaints.append(Complaint("note", "values", "of X, Y, Z the second is read"))
    if quantity == "DSF":
        f = f / np.maximum(np.abs(np.cos(np.radians(table[:, 0]))), HORIZON)
    complaints += below_zero(f)
    turn = UPWARDS - _upwards(path, keys)
    around = (table[:, 1] + turn) % 360.0
    angles = np.column_stack([np.full((len(table), 2), (theta, (phi + turn) % 360.0)), table[:, 0], around])
    return BsdfData(
        tuple(slices_of(angles, f, complaints)),
        isotropic=True,
        mirrored=False,
        name=keys.get("sample_name", "") or path.stem,
        complaints=tuple(complaints),
        facts={key: keys[key] for key in ("sample_name", "upphi", "colorimetry") if key in keys},
    )


def _row(path: Path, at: int, content: str, columns: int | None) -> list[float]:
    fields = content.split()
    try:
        values = [number(field) for field in fields]
    except ValueError:
        values = [np.nan]
    if len(values) < 3 or not np.isfinite(values).all() or (columns is not None and len(values) != columns):
        raise FormatError(path, f"line {at}", f"{content[:60]!r} is no direction with its values", ADVICE)
    if not (0.0 <= values[0] <= 180.0 and abs(values[1]) <= 360.0):
        raise FormatError(path, f"line {at}", f"θ {values[0]:g}°, φ {values[1]:g}°", "Angles are in degrees.")
    return values


def _incidence(path: Path, keys: dict[str, str]) -> tuple[float, float]:
    words = (
        keys["incident_angle"].split() if "incident_angle" in keys else [keys.get("intheta", ""), keys.get("inphi", "")]
    )
    try:
        theta, phi = (number(word) for word in words[:2])
    except ValueError:
        advice = "The header states #intheta and #inphi, or #incident_angle."
        raise FormatError(path, "header", "no angles of incidence", advice) from None
    if not 0.0 <= theta <= 180.0 or abs(theta - 90.0) < 1e-6 or not abs(phi) <= 360.0:
        raise FormatError(path, "header", f"light from θ {theta:g}°, φ {phi:g}°", "θ is below 90°, or beyond it.")
    return theta, phi


def _upwards(path: Path, keys: dict[str, str]) -> float:
    """The azimuth [°] of the upwards direction of the sample."""
    stated = keys.get("upphi", "0")
    try:
        phi = number(stated)
    except ValueError:
        phi = np.nan
    if not abs(phi) <= 360.0:
        advice = "It is the azimuth of the upwards direction of the sample, in degrees."
        raise FormatError(path, "header", f"#upphi is {stated[:20]!r}", advice)
    return phi


FORMAT = BsdfFormat("pab", "PAB goniophotometer text", (".pab.dat",), recognise, read)
