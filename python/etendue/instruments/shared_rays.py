"""Positions of a scan that count the same rays: how much larger the variance of many of them together is."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from etendue.extras import scipy_part
from etendue.instruments.directional_scan import DirectionalScan
from etendue.instruments.goniometer_scan import GoniometerScan

Array = npt.NDArray[np.float64]


def together(scan: GoniometerScan | DirectionalScan) -> Array:
    """Variance of a sum over positions about each one over that of independent ones, shape (n,); 1 where each is.

    Two apertures share the rays that fall into both: for disks of diameter D whose middles are d apart a part
    (2/π) (arccos x − x √(1 − x²)) of them, x = d/D. Whatever is smooth over more than D sees the sum of these parts. Of the
    variance of a flux F, by N rays, F (1 − F)/N is that of the rays; the noise of photons is independent at each position.

    Examples
    --------
    >>> angle = np.arange(-9.0, 9.01, 0.1)
    >>> scan = GoniometerScan(angle, np.full(181, 1e-3), np.full(181, 1e-4), solid_angle=6.25e-4, shared_rays=100_000)
    >>> together(scan)[90].round(1), together(GoniometerScan(angle, scan.flux, scan.standard_error))[90]
    (np.float64(13.7), np.float64(1.0))
    """
    ones = np.ones(scan.flux.shape)
    if not scan.shared_rays or scan.solid_angle is None or scan.standard_error is None:
        return ones
    diameter = 2.0 * np.sqrt(scan.solid_angle / np.pi)
    more = _shared_in_plane(scan.angle, diameter) if isinstance(scan, GoniometerScan) else _shared(scan, diameter)
    whole = np.clip(scan.flux + scan.background, 0.0, 1.0)
    own = scan.standard_error**2
    of_rays = np.divide(whole * (1.0 - whole) / scan.shared_rays, own, out=np.ones_like(own), where=own > 0.0)
    return np.asarray(ones + more * np.minimum(of_rays, 1.0))


def _part(x: Array) -> Array:
    """Of a disk in another one of the same size whose middle is x diameters away."""
    x = np.minimum(x, 1.0)
    return np.asarray((2.0 / np.pi) * (np.arccos(x) - x * np.sqrt(1.0 - x * x)))


def _shared_in_plane(angle: Array, diameter: float) -> Array:
    """Sum of the parts that the other positions have, shape (n,)."""
    found = np.zeros(angle.shape)
    for k in range(1, angle.size):
        part = _part(np.radians(angle[k:] - angle[:-k]) / diameter)
        if not part.any():
            break
        found[k:] += part
        found[:-k] += part
    return found


def _shared(scan: DirectionalScan, diameter: float) -> Array:
    tree = scipy_part("spatial").cKDTree(scan.direction)
    pairs = tree.query_pairs(diameter, output_type="ndarray")
    part = _part(np.linalg.norm(scan.direction[pairs[:, 0]] - scan.direction[pairs[:, 1]], axis=1) / diameter)
    return np.asarray(np.bincount(pairs.ravel(), np.repeat(part, 2), len(scan.flux)), dtype=np.float64)
