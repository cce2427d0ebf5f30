"""Virtual measurements of a BSDF: what a goniospectrophotometer of finite apertures and a sphere would state of it."""

from __future__ import annotations

import math

import etendue as et
import numpy as np
import numpy.typing as npt
from etendue.quantities.bsdf_data import BsdfData, BsdfSlice, PolarGrid, direction, mirrored

Array = npt.NDArray[np.float64]

BEAM, APERTURE = 0.45, 0.8
"""Half-angles of the light that arrives and of the detector [°]: 0.9° and 1.6° are those of chapter 5."""

HORIZON = 2.0
"""Closer to the surface of the sample nothing is measured [°]: the sample itself would shade the detector."""

OFFSETS = np.concatenate([np.arange(0.0, 3.0, 0.2), np.arange(3.0, 10.0, 0.5), np.arange(10.0, 180.0, 2.5)])
"""Angles from the specular direction at which a scan stops [°], in the plane of incidence and across it."""


def disc(points: int) -> Array:
    """Points that are spread evenly over the unit disc, shape (points, 2)."""
    k = np.arange(points)
    r, a = np.sqrt((k + 0.5) / points), k * math.pi * (3.0 - math.sqrt(5.0))
    return np.column_stack([r * np.cos(a), r * np.sin(a)])


def around(centre: Array, half_angle: float, points: int) -> Array:
    """Directions within an angle [°] of others, shape (..., points, 3)."""
    x = np.cross(centre, np.where(np.abs(centre[..., 2:]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))
    x /= np.linalg.norm(x, axis=-1, keepdims=True)
    y = np.cross(centre, x)
    off = disc(points) * math.tan(math.radians(half_angle))
    found = centre[..., None, :] + off[:, :1] * x[..., None, :] + off[:, 1:] * y[..., None, :]
    return np.asarray(found / np.linalg.norm(found, axis=-1, keepdims=True))


def overlap(apart: Array) -> Array:
    """The part of a beam that an aperture holds whose centre is so far away [°]."""
    r, R, d = BEAM, APERTURE, np.clip(apart, 1e-12, None)
    a = r * r * np.arccos(np.clip((d * d + r * r - R * R) / (2 * d * r), -1, 1))
    b = R * R * np.arccos(np.clip((d * d + R * R - r * r) / (2 * d * R), -1, 1))
    root = 0.5 * np.sqrt(np.clip((-d + r + R) * (d + r - R) * (d - r + R) * (d + r + R), 0, None))
    both = np.where(d >= r + R, 0.0, np.where(d <= R - r, math.pi * r * r, a + b - root))
    return np.asarray(both / (math.pi * r * r))


def measured(bsdf: et.Bsdf, theta: float, scattered: Array) -> Array:
    """The BRDF [1/sr] as the instrument states it: flux over that which arrives, over solid angle and cosine.

    Directions are those of the detector, shape (..., 3); the light arrives at an angle [°] in the plane φ = 180°.
    """
    incident = direction(theta, 180.0)
    cells = around(scattered, APERTURE, 37)
    beams = around(incident[None], BEAM, 13)[0]
    f = np.mean([bsdf.evaluate(beam, cells) for beam in beams], axis=0)
    diffuse = np.mean(f * np.clip(cells[..., 2], 0.0, None), axis=-1)
    apart = np.degrees(np.arccos(np.clip(scattered @ mirrored(incident), -1.0, 1.0)))
    solid_angle = 2.0 * math.pi * (1.0 - math.cos(math.radians(APERTURE)))
    regular = float(bsdf.regular_reflectance(theta)) * overlap(apart) / solid_angle
    return np.asarray((diffuse + regular) / np.clip(scattered[..., 2], 1e-3, None))


def specular_reflectance(bsdf: et.Bsdf, theta: float) -> float:
    """The share of the light in the aperture at the specular direction, less that of an even surface of the same R."""
    at = mirrored(direction(theta, 180.0))
    solid_angle = 2.0 * math.pi * (1.0 - math.cos(math.radians(APERTURE)))
    f = float(measured(bsdf, theta, at[None])[0]) - total_reflectance(bsdf) / math.pi
    return max(0.0, f * solid_angle * at[2])


def total_reflectance(bsdf: et.Bsdf) -> float:
    """Of an integrating sphere, 8°/d."""
    return float(bsdf.reflectance(8.0))


def scan(bsdf: et.Bsdf, theta: float) -> BsdfSlice:
    """F in the plane of incidence and in that across it through the specular direction."""
    incident = direction(theta, 180.0)
    grid = PolarGrid("specular", OFFSETS, np.array([0.0, 90.0, 180.0, 270.0]))
    at = grid.directions(incident, transmitted=False)
    there = np.nan_to_num(at[..., 2], nan=-1.0) > math.sin(math.radians(HORIZON))
    values = np.full(grid.shape, np.nan)
    values[there] = measured(bsdf, theta, at[there])
    return BsdfSlice(incident, values, grid=grid)


def table(bsdf: et.Bsdf, thetas: tuple[float, ...]) -> et.BsdfTable:
    """The scans at some angles as a table, linear in azimuth between the planes, each with the reflectance of the sphere."""
    slices = []
    for theta in thetas:
        one = scan(bsdf, theta)
        # Two planes say too much of some lobes: a table of a tenth is one that can be asked.
        alone = et.BsdfTable(BsdfData((BsdfSlice(one.incident, 0.1 * one.values, grid=one.grid),), mirrored=True))
        factor = 0.1 * total_reflectance(bsdf) / float(alone.reflectance(theta))
        slices.append(BsdfSlice(one.incident, one.values * factor, grid=one.grid))
    return et.BsdfTable(BsdfData(tuple(slices), mirrored=True, name="scans"))
