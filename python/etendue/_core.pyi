"""The compiled core. Arrays in, arrays out; lengths in mm, angles in radians, fluxes as stored."""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias, TypedDict, final

import numpy as np
import numpy.typing as npt

_Floats: TypeAlias = npt.NDArray[np.float64]
_Progress: TypeAlias = Callable[[int], Any]

class _Tally(TypedDict):
    rays: int
    defects: list[int]
    flux: float
    flux_squared: float
    norm_error: float

class _Moments(TypedDict):
    zero_flux: int
    flux_range: list[float]
    bounds: list[list[float]]
    weighted_position: list[float]
    weighted_direction: list[float]
    weighted_outer: list[float]
    focus_rhs: list[float]

class _Cone(TypedDict):
    eye: Sequence[float]
    target: Sequence[float]
    right: Sequence[float]
    up: Sequence[float]
    normal: Sequence[float]
    width: float
    height: float
    columns: int
    rows: int
    acceptances: Sequence[float]

@final
class RayTable:
    """Ray records over the bytes of an array: in memory, or mapped from a file."""

    def __new__(
        cls,
        bytes: npt.NDArray[np.uint8],
        stride: int,
        position: int | None,
        direction: int,
        flux: int,
        double: bool,
        length_scale: float,
    ) -> RayTable: ...
    def __len__(self) -> int: ...

@final
class RingSource:
    """Concentric Lambertian rings; each ring is (inner [mm], outer [mm], flux [lm], rays per run)."""

    def __new__(cls, rings: Sequence[tuple[float, float, float, int]], runs: int, seed: int) -> RingSource: ...
    def __len__(self) -> int: ...

def read_rays(source: RayTable | RingSource, start: int, stop: int) -> tuple[_Floats, _Floats, _Floats]:
    """Rays ``start..stop`` as (position (n, 3) [mm], unit direction (n, 3), flux (n,))."""

def scan(
    source: RayTable | RingSource, threads: int | None = None, progress: _Progress | None = None
) -> tuple[_Tally, _Moments]:
    """One pass over a source."""

def cone_sums(
    source: RayTable | RingSource,
    cones: Sequence[_Cone],
    threads: int | None = None,
    progress: _Progress | None = None,
) -> tuple[list[tuple[_Floats, _Floats, npt.NDArray[np.uint64]]], _Tally]:
    """For each cone (Σ w, Σ w², rays), each of shape (acceptances, rows, columns), and the tally."""

_Masses: TypeAlias = _Floats | Sequence[tuple[int, _Floats]]

def polya_posterior(
    depths: Sequence[int],
    weight: _Floats,
    weight_squared: _Floats | None,
    base: _Masses | None,
    concentration: float,
    threads: int | None = None,
) -> tuple[_Floats, _Floats, float]:
    """Mean of mass over base mass per cell, mean of its square, ln evidence, for a grid of 2^depth cells per axis.

    `weight_squared` None: `weight` counts points. `base` None: uniform; an array: the mass of each cell; a sequence of
    (axes, masses): the product of factors over successive axes.
    """

def polya_evidence(
    depths: Sequence[int],
    weight: _Floats,
    weight_squared: _Floats | None,
    base: _Masses | None,
    concentration: float,
    threads: int | None = None,
) -> float:
    """ln evidence alone."""

def select_subset(start: int, stop: int, n: int, k: int, taken: int, seed: int) -> npt.NDArray[np.uint64]:
    """Indices in ``start..stop`` of a random k-subset of n, of which `taken` were taken before."""

def deal_parts(start: int, stop: int, parts: int, seed: int) -> npt.NDArray[np.uint32]:
    """The part of each ray in ``start..stop``."""
