"""The observer as a disk, figure 2.2 of [Audenaert2014]_: the étendue of what each pixel sends through it."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.quadrature import gauss_legendre
from etendue.units import MM2_PER_M2

Array = npt.NDArray[np.float64]

NODES = 3
"""Of Gauss's rule along each side of a pixel: exact for polynomials of the fifth degree."""

CHORDS = 128
"""Points around the disk: the rule of equal steps converges geometrically for a smooth periodic function."""


def check_disk(observer: Observer, screen: Screen, radius: float) -> None:
    """Refuse a disk that reaches behind the plane of the screen.

    Raises
    ------
    ArgumentError
        If so.

    Examples
    --------
    >>> check_disk(Observer(30, 0, 1000), Screen(10, 10, 4, 4), 5.0)
    """
    away = observer.position - np.array(observer.target)
    normal = screen.axes(observer)[2]
    height = float(away @ normal)
    tilt = math.sqrt(max(0.0, 1.0 - (height / float(np.linalg.norm(away))) ** 2))
    if not height - radius * tilt > 1e-9 * float(np.linalg.norm(away)):
        raise ArgumentError(
            f"observer_radius is {radius:g} mm: at {observer.distance:g} mm and θ = {observer.theta:g}° the observer's disk "
            "reaches behind the plane of the screen; give a smaller one, or plane='view'."
        )


def widest_angle(observer: Observer, screen: Screen, radius: float) -> float:
    """A bound of the angle between rays from a pixel to the disk and the line from the pixel's centre to the observer [°].

    Examples
    --------
    >>> round(widest_angle(Observer(0, 0, 1000), Screen(2, 2, 1, 1), 10.0), 3)
    0.654
    """
    nearest = float((observer.position - np.array(observer.target)) @ screen.axes(observer)[2])
    diagonal = math.hypot(screen.width / screen.columns, screen.height / screen.rows) / 2.0
    if radius >= nearest or diagonal >= nearest:
        return 180.0
    return math.degrees(math.asin(radius / nearest) + math.asin(diagonal / nearest))


def disk_etendue(observer: Observer, screen: Screen, radius: float) -> Array:
    """∫∫ cos θ dΩ dA over each pixel and the disk about the observer that faces the target [m² sr], shape (rows, columns).

    The projected solid angle of the disk from a point is a contour integral around its rim,
    |½ ∮ n · (ρ × dρ)/ρ²| with ρ from the point to the rim and the pixel's normal n (Lambert's formula for a smooth curve);
    Gauss's rule averages it over the pixel.

    Parameters
    ----------
    observer : Observer
        In the middle of the disk.
    screen : Screen
        Of the pixels.
    radius : float
        Of the disk [mm].

    Examples
    --------
    A small disk far away is seen under π r²/d²:

    >>> found = disk_etendue(Observer(0, 0, 1000), Screen(1, 1, 1, 1), 1.0)[0, 0]
    >>> round(float(found / (1e-6 * math.pi * 1e-6)), 5)
    1.0
    """
    right, up, normal = screen.axes(observer)
    target = np.array(observer.target)
    away = (observer.position - target) / np.linalg.norm(observer.position - target)
    # Two axes of the disk's plane, from the axis of the world that is least along its normal.
    first = np.cross(away, np.eye(3)[np.argmin(np.abs(away))])
    first /= np.linalg.norm(first)
    second = np.cross(away, first)
    nodes, weights = gauss_legendre(NODES)
    side_x, side_y = screen.width / screen.columns, screen.height / screen.rows
    turn = (np.arange(CHORDS) + 0.5) * (2.0 * math.pi / CHORDS)
    total = np.zeros(screen.shape)
    for u, along in zip(nodes, weights, strict=True):
        for v, across in zip(nodes, weights, strict=True):
            x, y = screen.x + 0.5 * u * side_x, screen.y + 0.5 * v * side_y
            points = target + x[None, :, None] * right + y[:, None, None] * up
            seen = np.zeros(screen.shape)
            for phi in turn:
                rim = radius * (math.cos(phi) * first + math.sin(phi) * second)
                step = radius * (math.cos(phi) * second - math.sin(phi) * first)
                ray = observer.position + rim - points
                # n · (ρ × dρ) = (dρ × n) · ρ.
                seen += (ray @ np.cross(step, normal)) / np.einsum("rcj,rcj->rc", ray, ray)
            total += 0.25 * along * across * np.abs(seen) * (math.pi / CHORDS)
    result: Array = total * (side_x * side_y / MM2_PER_M2)
    return result
