"""Who looks, and through which pixel grid."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError
from etendue.quantities.arguments import as_point, require, require_known, require_numbers

Plane = Literal["view", "xy"]
PLANES: tuple[Plane, ...] = get_args(Plane)
MAX_PIXELS = 1 << 26
"""Most pixels of a screen: the sums over its rays take 24 bytes each."""

Vector = npt.NDArray[np.float64]

ALONG_THE_LINE = 1e-6
"""Sine of the angle between `up` and the line of sight below which rounding decides what is upright."""


@dataclasses.dataclass(frozen=True)
class Observer:
    """The point from which a source is looked at.

    The observer stands at ``target + distance · (sin θ cos φ, sin θ sin φ, cos θ)`` and looks at the target.

    Parameters
    ----------
    theta : float
        Polar angle θ from +Z [°], 0 to 180.
    phi : float
        Azimuth φ from +X towards +Y [°].
    distance : float
        From target to observer [mm], > 0 and finite.
    target : tuple of 3 floats
        The point looked at [mm].
    up : tuple of 3 floats, optional
        The direction, of any length, that stands upright in the picture. If it is not given, the axes of the screen are +X
        and +Y under the shortest rotation that takes +Z to the observer.
    roll : float
        By how much the head is tilted to its left about the line of sight [°], after `up`: the screen's right and up axes
        turn anticlockwise as the observer sees them, and the picture clockwise.

    Raises
    ------
    ArgumentError
        If an angle, the distance or the target is out of its domain, or `up` lies along the line of sight.

    Examples
    --------
    >>> Observer(theta=90, phi=0, distance=1000).position.round(9).tolist()
    [1000.0, 0.0, 0.0]

    A lamp along Z, looked at from +X, lies on its side unless +Z is said to be up:

    >>> [(Screen(1, 1, 1, 1).axes(Observer(90, 0, 1000, up=up))[1] + 0.0).tolist() for up in (None, (0, 0, 1))]
    [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """

    theta: float
    phi: float
    distance: float
    target: tuple[float, float, float] = (0.0, 0.0, 0.0)
    up: tuple[float, float, float] | None = None
    roll: float = 0.0

    def __post_init__(self) -> None:
        require_numbers(self, "theta", "phi", "roll", instead="an angle in °")
        require_numbers(self, "distance", instead="a length in mm")
        if not 0.0 <= self.theta <= 180.0:
            raise ArgumentError(f"Observer: theta is {self.theta:g}°; give 0° to 180°, measured from +Z.")
        if not math.isfinite(self.phi):
            raise ArgumentError(f"Observer: phi is {self.phi:g}°; give a finite azimuth.")
        if not (math.isfinite(self.distance) and self.distance > 0.0):
            raise ArgumentError(f"Observer: distance is {self.distance:g} mm; give a finite distance above 0.")
        target = as_point(self.target, "Observer: target", "three finite coordinates in mm")
        object.__setattr__(self, "target", target)
        if not math.isfinite(self.roll):
            raise ArgumentError(f"Observer: roll is {self.roll:g}°; give a finite angle.")
        if self.up is not None:
            self._check_up(self.up)

    def _check_up(self, up: tuple[float, ...]) -> None:
        wanted = "a direction as three finite numbers, not all 0"
        upright = as_point(up, "Observer: up", wanted)
        if not any(upright):
            raise ArgumentError(f"Observer: up is {_told(upright)}; give {wanted}.")
        object.__setattr__(self, "up", upright)
        along = np.linalg.norm(np.cross(_unit(upright), self.direction))
        if along < ALONG_THE_LINE:
            raise ArgumentError(
                f"Observer: up is {_told(upright)}, along the line of sight from θ = {self.theta:g}°, φ = {self.phi:g}°: "
                "nothing stands upright there; give another direction, or roll alone."
            )

    @property
    def direction(self) -> Vector:
        """Unit vector from the target to the observer, shape (3,)."""
        c, s = cos_sin_degrees(self.phi)
        ct, st = cos_sin_degrees(self.theta)
        return np.array((st * c, st * s, ct))

    @property
    def position(self) -> Vector:
        """Where the observer stands [mm], shape (3,)."""
        return np.asarray(self.target) + self.distance * self.direction

    def axes(self) -> tuple[Vector, Vector, Vector]:
        """Unit vectors right, up and towards the observer of what he sees, each of shape (3,)."""
        right, up, toward = self._rotation()
        if self.up is not None:
            # What of `up` is across the line of sight is upright in the picture.
            right = np.cross(_unit(self.up), toward)
            right = _unit(right) + 0.0  # no minus zeros
            up = np.cross(toward, right) + 0.0
        if self.roll == 0.0:
            return right, up, toward
        c, s = cos_sin_degrees(self.roll)
        return c * right + s * up, c * up - s * right, toward

    def _rotation(self) -> tuple[Vector, Vector, Vector]:
        """Images of +X, +Y, +Z under the shortest rotation that takes +Z to the observer.

        R = Rz(φ) Ry(θ) Rz(-φ): a turn by θ about the axis (-sin φ, cos φ, 0). At θ = 180° the shortest rotation is not
        unique; this form stays continuous and lets φ choose the axis.
        """
        # Exact values at the quarter turns, so that φ = 90° gives exactly +Y and not 6e-17 of +X.
        c, s = cos_sin_degrees(self.phi)
        ct, st = cos_sin_degrees(self.theta)
        right = (ct * c * c + s * s, (ct - 1.0) * c * s, -st * c)
        up = ((ct - 1.0) * c * s, ct * s * s + c * c, -st * s)
        return np.array(right), np.array(up), self.direction


def _told(vector: tuple[float, ...]) -> str:
    return f"({', '.join(f'{component:g}' for component in vector)})"


def _unit(vector: npt.ArrayLike) -> Vector:
    found = np.asarray(vector, dtype=np.float64)
    # Scaled to 1 first, so that no square overflows or vanishes.
    found = found / np.abs(found).max()
    unit: Vector = found / np.linalg.norm(found)
    return unit


def cos_sin_degrees(angle: float) -> tuple[float, float]:
    """Cosine and sine of an angle [°], exact at quarter turns.

    Examples
    --------
    >>> cos_sin_degrees(-90)
    (0.0, -1.0)
    """
    quarter, rest = divmod(angle, 90.0)
    c, s = math.cos(math.radians(rest)), math.sin(math.radians(rest))
    for _ in range(int(quarter) % 4):
        c, s = -s, c
    return c, s


@dataclasses.dataclass(frozen=True)
class Screen:
    """The pixel grid through the observer's target.

    Parameters
    ----------
    width, height : float
        Extent of the grid [mm], > 0.
    columns, rows : int
        Number of pixels, ≥ 1. Row 0 is the top, column 0 the left.
    plane : {"view", "xy"}
        ``"view"``: perpendicular to the line of sight; its axes are those of the observer, +X (right) and +Y (up) turned
        by the shortest rotation that takes +Z to him unless he says what is up. ``"xy"``: fixed parallel to the source's
        XY plane (the ray collecting surface of [Audenaert2014]_ 2.2.1); the apparent pixel area then carries its cosine.

    Raises
    ------
    ArgumentError
        If a size is not positive.

    Examples
    --------
    >>> Screen(25, 25, 128, 128).pixel_area
    0.03814697265625
    """

    width: float
    height: float
    columns: int
    rows: int
    plane: Plane = "view"

    def __post_init__(self) -> None:
        require_numbers(self, "width", "height", "columns", "rows")
        for name in ("width", "height"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ArgumentError(f"Screen: {name} is {value:g} mm; give a finite size above 0.")
        for name in ("columns", "rows"):
            value = getattr(self, name)
            if not 1 <= value <= 65536 or int(value) != value:  # in this order: NaN and infinity have no int
                raise ArgumentError(f"Screen: {name} is {value}; give a whole number of pixels, 1 to 65536.")
            object.__setattr__(self, name, int(value))
        if self.columns * self.rows > MAX_PIXELS:
            raise ArgumentError(
                f"Screen: {self.columns} × {self.rows} pixels are too many for any memory; give {MAX_PIXELS:,} at most."
            )
        require_known(self.plane, PLANES, "screen plane")

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns)."""
        return self.rows, self.columns

    @property
    def pixel_area(self) -> float:
        """Area of one pixel [mm²]."""
        return (self.width / self.columns) * (self.height / self.rows)

    @property
    def x(self) -> Vector:
        """Pixel centres along the right axis, from the target [mm], shape (columns,), rising."""
        return (np.arange(self.columns, dtype=np.float64) + 0.5) * (self.width / self.columns) - self.width / 2

    @property
    def y(self) -> Vector:
        """Pixel centres along the up axis, from the target [mm], shape (rows,), falling: row 0 is the top."""
        return self.height / 2 - (np.arange(self.rows, dtype=np.float64) + 0.5) * (self.height / self.rows)

    def axes(self, observer: Observer) -> tuple[Vector, Vector, Vector]:
        """Unit vectors right, up and normal of the grid for this observer, each of shape (3,).

        Raises
        ------
        ArgumentError
            If ``plane="xy"`` and the observer stands in that plane (θ = 90°): every pixel's apparent area is zero; or he has
            `up` or `roll`, which turn no fixed plane.
        """
        require(observer, Observer, "Screen: observer", "an Observer: et.Observer(theta, phi, distance)")
        if self.plane == "view":
            return observer.axes()
        if observer.up is not None or observer.roll != 0.0:
            raise ArgumentError(
                "Screen: plane='xy' is fixed, whatever is up for the observer; use plane='view' with up and roll."
            )
        if observer.direction[2] == 0.0:
            raise ArgumentError(
                "Screen: plane='xy' seen from theta = 90° has no apparent area; use plane='view' or another theta."
            )
        return np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])

    def core_view(self, observer: Observer) -> _core._View:
        """The observer's view of this screen as the compiled core takes it."""
        right, up, normal = self.axes(observer)
        return {
            "eye": observer.position.tolist(),
            "target": observer.target,
            "right": right.tolist(),
            "up": up.tolist(),
            "normal": normal.tolist(),
            "width": float(self.width),
            "height": float(self.height),
            "columns": self.columns,
            "rows": self.rows,
        }

    def cosine(self, observer: Observer) -> npt.NDArray[np.float64]:
        """Cosine between the grid's normal and the line from each pixel centre to the observer, shape (rows, columns).

        This is |cos θ_p| of eq. 2.3 of [Audenaert2014]_; times the pixel area it is the apparent pixel area.
        """
        right, up, normal = self.axes(observer)
        to_eye = observer.distance * observer.direction
        a, b, h = (float(to_eye @ axis) for axis in (right, up, normal))
        du = a - self.x[None, :]
        dv = b - self.y[:, None]
        cosine: Vector = np.abs(h) / np.sqrt(du * du + dv * dv + h * h)
        return cosine


def observer_to_dict(observer: Observer) -> dict[str, Any]:
    """Plain data; `up` and `roll` are in it only where they are stated, so that other files stay as they were.

    Examples
    --------
    >>> observer_to_dict(Observer(30, 0, 1000, roll=15))
    {'theta': 30, 'phi': 0, 'distance': 1000, 'target': (0.0, 0.0, 0.0), 'roll': 15}
    """
    data = dataclasses.asdict(observer)
    return {name: value for name, value in data.items() if not (name in ("up", "roll") and not value)}


def observer_from_dict(data: dict[str, Any]) -> Observer:
    """Rebuild an observer from `observer_to_dict`."""
    values: dict[str, Any] = {name: tuple(v) if isinstance(v, list) else v for name, v in data.items()}
    return Observer(**values)
