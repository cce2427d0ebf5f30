"""What all detectors share: how one is described, and how it makes a quantity of what it recorded."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, ClassVar, Generic, Protocol, Self, TypeVar

import numpy as np
import numpy.typing as npt

from etendue.description.files import Files
from etendue.description.keys import Description
from etendue.quantities.node_choice import Choice
from etendue.quantities.pixel_map import PixelMap
from etendue.quantities.provenance import Provenance
from etendue.quantities.unlifted import unlifted
from etendue.scene.dealing import Array, CellSums, Dealing
from etendue.scene.observers import ObserverKeys
from etendue.units import FluxUnit

Record = dict[str, Any]
Q = TypeVar("Q")
"""The quantity that a detector measures: a value with `notes`."""


@dataclasses.dataclass(frozen=True)
class Setting:
    """What a detector may need to know of the scene that it stands in.

    Parameters
    ----------
    observers : mapping
        Those of the scene, by name.
    choices : iterator of Choice
        The nodes of each far field, in the order of the detectors.
    geometry : callable
        Gives the fingerprint of what stands in the scene.
    """

    observers: Mapping[str, ObserverKeys]
    choices: Iterator[Choice]
    geometry: Callable[[], str]


@dataclasses.dataclass(frozen=True, eq=False)
class Counted:
    """The cells of a detector after a number of rays.

    Parameters
    ----------
    flux : array
        [flux unit], of each cell, scaled to the whole trace.
    error : array
        Its standard error; NaN for cells that no ray reached.
    rays : array of int64
        That contributed, copies of one counted once.
    """

    flux: Array
    error: Array
    rays: npt.NDArray[np.int64]

    @classmethod
    def of(cls, cells: CellSums, dealing: Dealing, rays: int, sources: CellSums) -> Counted:
        """Of sums over the first `rays` rays of a run, scaled to all of them; errors as of `Dealing.variance`."""
        scale, count = dealing.rays / rays, cells[2].sum(axis=0)
        error = np.where(count > 0, np.sqrt(dealing.variance(cells, rays, sources)) * scale, np.nan)
        return cls(cells[0].sum(axis=0) * scale, error, count.astype(np.int64))

    @property
    def relative_error(self) -> float:
        """Median over the flux of the relative standard errors of the cells; NaN if no ray reached any."""
        lit = self.flux > 0.0
        if not lit.any():
            return float("nan")
        share = self.error[lit] / self.flux[lit]
        order = np.argsort(share)
        below = np.cumsum(self.flux[lit][order])
        return float(share[order][np.searchsorted(below, below[-1] / 2.0)])


@dataclasses.dataclass(frozen=True)
class Origin:
    """What all quantities of a trace have in common."""

    flux_unit: FluxUnit
    provenance: Provenance
    notes: tuple[str, ...]


class Recorded(Protocol):
    """What a trace recorded for one detector."""

    @property
    def origin(self) -> Origin:
        """What all quantities of the trace have in common."""

    @property
    def counted(self) -> Counted:
        """Its cells."""

    @property
    def rays(self) -> npt.NDArray[Any]:
        """The rays that it kept, with the flux that they were traced with, shape (n,)."""

    @property
    def dealing(self) -> Dealing:
        """Which source gave out which ray of the trace."""

    @property
    def scale(self) -> float:
        """Rays asked for over rays done."""

    def scatter_events(self, name: str, most: int, surfaces: tuple[str, ...], geometry: str) -> Any:
        """The scatter events that it kept: a `ScatterEvents`, which knows the scene and therefore stands above it."""


@dataclasses.dataclass(frozen=True)
class Detection(abc.ABC, Generic[Q]):
    """What a detector of a scene measures; plain data, which files of results hold.

    Parameters
    ----------
    name : str
        Of the detector.
    """

    KIND: ClassVar[str]
    """Of the detector."""

    HAS_FACE: ClassVar[bool] = False
    """Whether light passes a face of it."""

    HAS_WHOLE: ClassVar[bool] = False
    """Whether its last cell is of all light together: a ray may come to several cells, or again and again, and what it
    brings to them is not independent."""

    name: str

    @property
    def cells(self) -> int:
        """Number of cells that flux is summed in."""
        return 0

    @property
    def most_events(self) -> int:
        """Number of scatter events that are kept at most."""
        return 0

    def counted(self, cells: CellSums, sources: CellSums, dealing: Dealing, rays: int) -> Counted:
        """Its cells, from sums over the first `rays` rays of a run; `sources` are those of what sources emitted."""
        return Counted.of(cells, dealing, rays, sources)

    @property
    def judged(self) -> int:
        """Number of cells that tell how well light is known: the first ones, without that of all light."""
        return self.cells - self.HAS_WHOLE

    def relative_error(self, counted: Counted) -> float:
        """Median over the flux of the relative standard errors of these cells; NaN if no ray reached any."""
        own = slice(self.judged)
        return Counted(counted.flux[own], counted.error[own], counted.rays[own]).relative_error

    @abc.abstractmethod
    def read(self, recorded: Recorded) -> Q:
        """The quantity."""

    @abc.abstractmethod
    def summary(self, quantity: Q) -> str:
        """The quantity in a line, without the flux of all light, if there is a cell of it."""

    def figures(self, quantity: Q) -> dict[str, Any]:  # noqa: ARG002 - not every quantity has figures
        """The quantity in figures without that flux, as plain data for JSON."""
        return {}

    def to_dict(self) -> dict[str, Any]:
        """Plain data for files."""
        return {"kind": self.KIND, **dataclasses.asdict(self)}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Inverse of `to_dict`."""
        return cls(**data)


class Detector(Description, abc.ABC):
    """Something that records light.

    Parameters
    ----------
    name : str
        For results and messages.
    """

    DETECTION: ClassVar[type[Detection[Any]]]
    """What it measures."""

    name: str = ""

    @abc.abstractmethod
    def record(self, files: Files, observers: dict[str, ObserverKeys], faces: Sequence[str] = ()) -> Record:
        """The detector as the core takes it; `observers` are those of the scene by name, `faces` the names of its faces.

        Raises
        ------
        ArgumentError, UnknownNameError, FormatError, OSError
            If it does not fit.
        """

    @abc.abstractmethod
    def detection(self, name: str, setting: Setting) -> Detection[Any]:
        """What it measures in its scene, under a name that no other detector there has."""


def brightest_of(quantity: PixelMap) -> dict[str, Any]:
    """The brightest pixel or cell of a map, also without what chance lifts it by, and how many there are, as data for JSON.

    Examples
    --------
    >>> import etendue as et
    >>> eye, screen = et.Observer(0, 0, 500), et.Screen(60, 60, 4, 3)
    >>> brightest_of(et.luminance_map(et.RingSource(rays=2000), eye, screen, method=et.Cone(acceptance=5)))["columns"]
    4
    """
    rows, columns = quantity.values.shape
    brightest = np.unravel_index(np.argmax(quantity.values), quantity.values.shape)
    return {
        "maximum": float(quantity.values[brightest]),
        "maximum_error": float(quantity.standard_error[brightest]),
        "maximum_apart": unlifted(quantity.values, quantity.standard_error, np.ones(quantity.values.shape)).value,
        "unit": quantity.unit,
        "columns": columns,
        "rows": rows,
    }
