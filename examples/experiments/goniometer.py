"""Virtual measurements of a BSDF: what a goniospectrophotometer of finite apertures and a sphere would state of it."""

from __future__ import annotations

import functools
import math

import etendue as et
import numpy as np
import numpy.typing as npt
from etendue.quantities.bsdf_data import BsdfData
from etendue.quantities.bsdf_directions import direction, mirrored
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid

Array = npt.NDArray[np.float64]

INSTRUMENT = et.ScatterGoniometer()
"""That of chapter 5: its beam is 0.9° wide seen from the detector, its aperture 1.6° seen from the sample."""

HORIZON = 2.0
"""Closer to the surface of the sample nothing is measured [°]: the sample itself would shade the detector."""

OFFSETS = np.concatenate([np.arange(0.0, 3.0, 0.2), np.arange(3.0, 10.0, 0.5), np.arange(10.0, 180.0, 2.5)])
"""Angles from the specular direction at which a scan stops [°], in the plane of incidence and across it."""


def measured(bsdf: et.Bsdf, theta: float, scattered: Array) -> Array:
    """The BRDF [1/sr] as the instrument states it (eq. 5.1), what is mirrored included.

    Directions are those of the detector, shape (n, 3); the light arrives at an angle [°] in the plane φ = 180°.
    """
    flux, _ = INSTRUMENT.flux_at(bsdf, scattered, theta, method="quadrature")
    return np.asarray(flux / (INSTRUMENT.solid_angle * np.clip(scattered[:, 2], 1e-3, None)))


def specular_reflectance(bsdf: et.Bsdf, theta: float) -> float:
    """The share of the light in the aperture at the specular direction, less that of an even surface of the same R."""
    at = mirrored(direction(theta, 180.0))
    f = float(measured(bsdf, theta, at[None])[0]) - total_reflectance(bsdf) / math.pi
    return max(0.0, f * INSTRUMENT.solid_angle * at[2])


def total_reflectance(bsdf: et.Bsdf) -> float:
    """Of an integrating sphere, 8°/d."""
    return float(bsdf.reflectance(8.0))


@functools.cache
def scan(bsdf: et.Bsdf, theta: float) -> BsdfSlice:
    """F in the plane of incidence and in that across it through the specular direction."""
    incident = direction(theta, 180.0)
    grid = PolarGrid("specular", OFFSETS, np.array([0.0, 90.0, 180.0, 270.0]))
    at = grid.directions(incident, transmitted=False)
    there = np.nan_to_num(at[..., 2], nan=-1.0) > math.sin(math.radians(HORIZON))
    values = np.full(grid.shape, np.nan)
    values[there] = measured(bsdf, theta, at[there])
    return BsdfSlice(incident, values, grid=grid)


def noisy(bsdf: et.Bsdf, theta: float, noise: float) -> BsdfSlice:
    """The same with a relative standard error of each value."""
    one = scan(bsdf, theta)
    errors = np.random.default_rng(round(1000 * theta)).standard_normal(one.values.shape)
    return BsdfSlice(one.incident, one.values * np.maximum(1.0 + noise * errors, 0.0), grid=one.grid)


def smoothed(bsdf: et.Bsdf, thetas: tuple[float, ...], noise: float) -> et.Bsdf:
    """The scans at some angles as the package makes a table of scans with errors: smooth, as far as the values say."""
    slices = [noisy(bsdf, theta, noise) for theta in thetas]
    known = [~np.isnan(one.values) for one in slices]
    values = np.concatenate([one.values[there] for one, there in zip(slices, known, strict=True)])
    scans = et.Scans(
        np.concatenate([np.tile(one.incident, (there.sum(), 1)) for one, there in zip(slices, known, strict=True)]),
        np.concatenate([one.directions[there] for one, there in zip(slices, known, strict=True)]),
        values,
        standard_error=noise * values,
        reflectance=total_reflectance(bsdf),
    )
    return et.Bsdf.from_scans(scans, method="smooth")


def table(bsdf: et.Bsdf, thetas: tuple[float, ...], noise: float = 0.0) -> et.BsdfTable:
    """The scans at some angles as a table, linear in azimuth between the planes, each with the reflectance of the sphere."""
    slices = []
    for theta in thetas:
        one = noisy(bsdf, theta, noise)
        # Two planes say too much of some lobes: a table of a tenth is one that can be asked.
        alone = et.BsdfTable(BsdfData((BsdfSlice(one.incident, 0.1 * one.values, grid=one.grid),), mirrored=True))
        factor = 0.1 * total_reflectance(bsdf) / float(alone.reflectance(theta))
        slices.append(BsdfSlice(one.incident, one.values * factor, grid=one.grid))
    return et.BsdfTable(BsdfData(tuple(slices), mirrored=True, name="scans"))
