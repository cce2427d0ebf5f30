"""Tables of MERL [Matusik2003]_: RGB over half and difference angles, isotropic."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import numpy.typing as npt

from etendue.errors import FormatError
from etendue.formats.bsdf.bsdf_format import BsdfFormat
from etendue.formats.bsdf.functions import sampled
from etendue.formats.bsdf.tokens import ADVICE
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.report import Complaint

Array = npt.NDArray[np.float64]

SHAPE = (90, 90, 180)
"""Half angle θh, difference angle θd, azimuth φd."""

SCALES = np.array([1.0, 1.15, 1.66]) / 1500.0
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Of linear RGB with the primaries of ITU-R BT.709, which these data are taken to have."""

INCIDENCES = (*np.arange(0.0, 81.0, 5.0).tolist(), 84.0, 87.0)


def recognise(head: bytes) -> bool:
    """By the three dimensions."""
    return head[:12] == struct.pack("<3i", *SHAPE)


def read(path: Path) -> BsdfData:
    """Read the luminance of the three channels; what is below 0 was not measured.

    θh is tabled evenly in its square root, θd and φd evenly in angle; cells stand for their middle.
    """
    with path.open("rb") as file:
        data = file.read(12 + 8 * 3 * int(np.prod(SHAPE)) + 1)
    expected = 12 + 8 * 3 * int(np.prod(SHAPE))
    if len(data) != expected:
        found = f"{len(data)} bytes" if len(data) < expected else "more bytes than the table has"
        raise FormatError(path, "length", f"{found}; {expected} are due", ADVICE)
    channels = np.frombuffer(data, "<f8", offset=12).reshape(3, *SHAPE)
    if not np.isfinite(channels).all():
        raise FormatError(path, "values", "a value that is not finite", ADVICE)
    scaled = np.where(channels < 0.0, np.nan, channels * SCALES[:, None, None, None])
    table = np.einsum("c,chdp->hdp", LUMINANCE, scaled)
    slices = sampled(lambda i, s: _at(table, i, s), ((theta, 0.0) for theta in INCIDENCES))
    text = "of three colours the luminance is read; no more than 1° about the specular direction is resolved"
    return BsdfData(tuple(slices), name=path.stem, complaints=(Complaint("note", "colours", text),))


def _at(table: Array, incident: Array, scattered: Array) -> Array:
    """Trilinear between cells that hold something; φd turns back on itself after half a turn."""
    half = incident + scattered
    half = half / np.linalg.norm(half, axis=-1, keepdims=True)
    theta_h = np.arccos(np.clip(half[:, 2], -1.0, 1.0))
    phi_h = np.arctan2(half[:, 1], half[:, 0])
    # The incident direction, turned so that the half vector is the normal.
    c, s = np.cos(phi_h), np.sin(phi_h)
    x, y, z = c * incident[:, 0] + s * incident[:, 1], -s * incident[:, 0] + c * incident[:, 1], incident[:, 2]
    x, z = np.cos(theta_h) * x - np.sin(theta_h) * z, np.sin(theta_h) * x + np.cos(theta_h) * z
    theta_d, phi_d = np.arccos(np.clip(z, -1.0, 1.0)), np.arctan2(y, x) % np.pi
    places = (
        np.sqrt(np.degrees(theta_h) / 90.0) * SHAPE[0],
        np.degrees(theta_d) / 90.0 * SHAPE[1],
        np.degrees(phi_d) / 180.0 * SHAPE[2],
    )
    total, weight = np.zeros(len(incident)), np.zeros(len(incident))
    corners = []
    for axis, place in enumerate(places):
        low = np.floor(place - 0.5)
        part = place - 0.5 - low
        around = axis == 2
        index = [
            ((low + k) % SHAPE[axis] if around else np.clip(low + k, 0, SHAPE[axis] - 1)).astype(int) for k in (0, 1)
        ]
        corners.append([(index[0], 1.0 - part), (index[1], part)])
    for h, wh in corners[0]:
        for d, wd in corners[1]:
            for p, wp in corners[2]:
                value, w = table[h, d, p], wh * wd * wp
                known = ~np.isnan(value)
                total += np.where(known, w * np.where(known, value, 0.0), 0.0)
                weight += np.where(known, w, 0.0)
    return np.where(weight > 0.0, total / np.where(weight > 0.0, weight, 1.0), np.nan)


FORMAT = BsdfFormat("merl", "MERL table", (".binary",), recognise, read)
