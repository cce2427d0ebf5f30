"""From the sums of a detector to the quantity that it measures: one class per kind."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.quantities.illuminance_map import IlluminanceMap, Point
from etendue.quantities.intensity import Intensity
from etendue.quantities.intensity_nodes import MOST_CELLS, Nodes
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen, observer_from_dict
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.scene.dealing import Array, CellSums, Dealing
from etendue.scene.scatter_events import ScatterEvents
from etendue.scene.scene import Scene
from etendue.tracing.scattered import Scattered
from etendue.tracing.sums import RECORD, Collected
from etendue.units import MM2_PER_M2, FluxUnit


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
    def of(cls, cells: CellSums, dealing: Dealing, rays: int) -> Counted:
        """Of sums over the first `rays` rays of a run, scaled to all of them; errors as of `Dealing.variance`."""
        scale, count = dealing.rays / rays, cells[2].sum(axis=0)
        error = np.where(count > 0, np.sqrt(dealing.variance(cells, rays)) * scale, np.nan)
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


@dataclasses.dataclass(frozen=True)
class Detection(abc.ABC):
    """What a detector of the scene measures.

    Parameters
    ----------
    name : str
        Of the detector.
    """

    KIND: ClassVar[str]
    name: str

    @property
    def cells(self) -> int:
        """Number of cells that flux is summed in."""
        return 0

    @property
    def most_events(self) -> int:
        """Number of scatter events that are kept at most."""
        return 0

    def relative_error(self, counted: Counted) -> float:
        """Median over the flux of the relative standard errors of its cells; NaN if no ray reached any."""
        return counted.relative_error

    def to_dict(self) -> dict[str, Any]:
        """Plain data for files."""
        return {"kind": self.KIND, **dataclasses.asdict(self)}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Detection:
        """Inverse of `to_dict`."""
        return cls(**data)


@dataclasses.dataclass(frozen=True)
class IncidentRays(Detection):
    """The rays that cross a ray collecting surface."""

    KIND = "rays"

    def read(self, collected: Collected, dealing: Dealing, scale: float, origin: Origin) -> RaySet:
        """The rays, with a wavelength each unless all have the same."""
        records = collected.array()
        meaning = RaySetMeaning(
            flux_unit=origin.flux_unit,
            stored_flux_scale=scale,
            provenance=origin.provenance.then(f"rays incident on {self.name!r}"),
            copies=dealing.most_copies(),
        )
        wavelength = records["wavelength"]
        if len(records) and (wavelength == wavelength[0]).all():
            names = [name for name in RECORD.names or () if name != "wavelength"]
            # The same records, of which one field is passed over.
            records = records[names]
            meaning = dataclasses.replace(meaning, single_wavelength=float(wavelength[0]))
        return RaySet.from_records(records, meaning)


@dataclasses.dataclass(frozen=True)
class FarFieldIntensity(Detection):
    """The intensity of what leaves the scene.

    Parameters
    ----------
    nodes : Nodes
        What rays are shared by.
    told : tuple of str
        What there is to say about them.
    """

    KIND = "intensity"
    nodes: Nodes
    told: tuple[str, ...] = ()

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Detection:
        """Inverse of `to_dict`."""
        return cls(data["name"], Nodes.from_dict(data["nodes"]), tuple(data["told"]))

    @property
    def cells(self) -> int:
        """Number of cells that flux is summed in: one for each node, and the last one for all rays together."""
        return len(self.nodes)

    def relative_error(self, counted: Counted) -> float:
        """As of the nodes."""
        return Counted(counted.flux[:-1], counted.error[:-1], counted.rays[:-1]).relative_error

    def read(self, counted: Counted, origin: Origin) -> Intensity:
        """Shares of each node over the solid angle of its hat."""
        notes = (*self.told, self.nodes.describe(), *origin.notes)
        provenance = origin.provenance.then(f"far-field intensity by {self.name!r}")
        return self.nodes.intensity(counted.flux, counted.error, origin.flux_unit, provenance, notes)


@dataclasses.dataclass(frozen=True)
class GridIlluminance(Detection):
    """Illuminance on a rectangle.

    Parameters
    ----------
    width, height, columns, rows
        Of the grid [mm].
    centre, right, up
        As of `IlluminanceMap`.
    """

    KIND = "illuminance"
    width: float
    height: float
    columns: int
    rows: int
    centre: Point
    right: Point
    up: Point

    @property
    def cells(self) -> int:
        """Number of cells that flux is summed in."""
        return self.columns * self.rows

    def read(self, counted: Counted, origin: Origin) -> IlluminanceMap:
        """Flux of each cell over its area."""
        screen = Screen(self.width, self.height, self.columns, self.rows, "xy")
        area = screen.pixel_area / MM2_PER_M2
        return IlluminanceMap(
            counted.flux.reshape(screen.shape) / area,
            counted.error.reshape(screen.shape) / area,
            counted.rays.reshape(screen.shape),
            screen,
            self.centre,
            self.right,
            self.up,
            origin.flux_unit,
            origin.provenance.then(f"illuminance on {self.name!r}"),
            origin.notes,
        )


@dataclasses.dataclass(frozen=True)
class LightImage(Detection):
    """The luminance of diffuse surfaces as an observer sees them: every scatter is connected to the eye.

    Parameters
    ----------
    observer : Observer
    screen : Screen
    """

    KIND = "image"
    observer: Observer
    screen: Screen

    @property
    def cells(self) -> int:
        """Number of cells that flux is summed in."""
        return self.screen.columns * self.screen.rows

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> LightImage:
        """Inverse of `to_dict`."""
        return cls(data["name"], observer_from_dict(data["observer"]), Screen(**data["screen"]))

    def read(self, counted: Counted, origin: Origin) -> LuminanceMap:
        """What the core sums is luminance in flux unit/(mm² sr)."""
        shape = self.screen.shape
        notes = ["light that reaches the eye from a diffuse surface directly; sources and mirrors are not seen in it"]
        dark = int((counted.rays == 0).sum())
        if dark:
            notes.append(
                f"{dark:,} of {counted.rays.size:,} pixels saw no scatter: their luminance is 0, its error unknown"
            )
        return LuminanceMap(
            counted.flux.reshape(shape) * MM2_PER_M2,
            counted.error.reshape(shape) * MM2_PER_M2,
            counted.rays.reshape(shape),
            self.observer,
            self.screen,
            origin.flux_unit,
            origin.provenance.then(f"light image {self.name!r}"),
            (*notes, *origin.notes),
        )


@dataclasses.dataclass(frozen=True)
class ScatteredLight(Detection):
    """Where light was scattered diffusely.

    Parameters
    ----------
    most : int
        How many scatters are kept at most.
    surfaces : tuple of str
        Whose; empty: of all.
    geometry : str
        Fingerprint of what stands in the scene.
    """

    KIND = "scatter"
    most: int
    surfaces: tuple[str, ...]
    geometry: str

    @property
    def most_events(self) -> int:
        """Number of scatter events that are kept at most."""
        return self.most

    def read(
        self,
        scattered: Scattered,
        dealing: Dealing,
        rays: int,
        faces: tuple[str, ...],
        scene: Scene | None,
        origin: Origin,
    ) -> ScatterEvents:
        """The events of the first `rays` rays of a run, which stand for all of them."""
        share = 0.5**scattered.level
        notes = (
            []
            if share == 1.0
            else [f"the scatters of 1 ray in {2**scattered.level:,} were kept, {self.most:,} at most"]
        )
        if self.surfaces:
            notes.append(f"scatters on {', '.join(self.surfaces)} only")
        return ScatterEvents(
            self.name,
            scattered.array(),
            dealing.rays / rays / share,
            share,
            rays,
            dealing,
            faces,
            self.surfaces,
            self.geometry,
            scene,
            origin.flux_unit,
            origin.provenance.then(f"scatter events of {self.name!r}"),
            (*notes, *origin.notes),
        )


DETECTIONS: dict[str, type[Detection]] = {
    cls.KIND: cls for cls in (IncidentRays, FarFieldIntensity, GridIlluminance, LightImage, ScatteredLight)
}
"""Every kind of detection."""


def detection_from_dict(data: Mapping[str, Any]) -> Detection:
    """Rebuild a detection from `Detection.to_dict`."""
    rest = {key: tuple(value) if isinstance(value, list) else value for key, value in data.items() if key != "kind"}
    return DETECTIONS[data["kind"]].from_dict(rest)


def check_cells(detections: tuple[Detection, ...]) -> None:
    """Refuse detectors with more cells than memory is meant for.

    Raises
    ------
    ArgumentError
        If so.
    """
    total = sum(detection.cells for detection in detections)
    if total > MOST_CELLS:
        raise ArgumentError(f"the detectors have {total:,} cells together; {MOST_CELLS:,} are the most. Use fewer.")
