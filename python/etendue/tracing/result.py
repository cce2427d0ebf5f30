"""What a trace found."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator
from functools import cached_property
from typing import Any, TypeVar

from etendue.errors import ArgumentError
from etendue.formats.input import as_path
from etendue.quantities.illuminance_map import IlluminanceMap
from etendue.quantities.intensity import Intensity
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.notebook import InNotebook
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_set import RaySet
from etendue.scene.dealing import Array, Counts
from etendue.scene.detectors.detector import Detection, Origin
from etendue.scene.detectors.illuminance import GridIlluminance
from etendue.scene.detectors.image import DiffuseLuminance
from etendue.scene.detectors.intensity import FarFieldIntensity
from etendue.scene.detectors.rays import IncidentRays
from etendue.scene.detectors.scatter import ScatteredLight
from etendue.scene.scatter_events import ScatterEvents
from etendue.tracing.ledger import Entry, Ledger, Loss
from etendue.tracing.named import ByName
from etendue.tracing.plan import Plan
from etendue.tracing.recorded import DetectorSums
from etendue.tracing.storage import load_result, save_result
from etendue.tracing.sums import Sums

T = TypeVar("T")


@dataclasses.dataclass(frozen=True, eq=False)
class TraceResult(InNotebook):
    """What the detectors of a scene saw, and what became of all light.

    A result of n of N rays is a valid one: every flux is scaled by N/n, every standard error is that of n rays. `trace`
    with ``resume=`` goes on from there, to the same bits as if it had never stopped.

    Parameters
    ----------
    plan : Plan
        What was to be traced.
    sums : Sums
        What the rounds done add up to.

    Examples
    --------
    >>> import etendue as et
    >>> scene = et.Scene(
    ...     sources=[{"name": "led", "kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 100}],
    ...     surfaces=[{"name": "half", "shape": {"kind": "rectangle", "width": 1e3, "height": 2e3}, "at": [500, 0, 1],
    ...                "finish": "absorber"}],
    ...     detectors=[{"name": "far", "kind": "intensity", "c_planes": 4, "gamma_step": 10}],
    ... )
    >>> result = et.trace(scene, rays=100_000)
    >>> result.ledger.closes, result.complete
    (True, True)
    >>> share = result.ledger.by_surface["half"].flux / 100
    >>> bool(abs(share - 0.5) < 0.01), result.intensity["far"].unit
    (True, 'cd')
    """

    plan: Plan
    sums: Sums

    def __repr__(self) -> str:
        """Rays done and asked for, and the detectors."""
        detectors = ", ".join(detection.name for detection in self.plan.detections) or "none"
        return (
            f"<TraceResult of {self.rays_done:,} of {self.rays_asked:,} rays, seed {self.seed}; detectors: {detectors}>"
        )

    @property
    def rays_asked(self) -> int:
        """Rays of the whole trace."""
        return self.plan.rays

    @property
    def rays_done(self) -> int:
        """Rays traced so far."""
        return self.sums.rays

    @property
    def seed(self) -> int:
        """Of the trace."""
        return self.plan.seed

    @property
    def complete(self) -> bool:
        """Whether all rays were traced."""
        return self.rays_done == self.rays_asked

    @property
    def scale(self) -> float:
        """Rays asked for over rays done."""
        return self.rays_asked / self.rays_done

    @property
    def provenance(self) -> Provenance:
        """Where the result comes from; its fingerprint is that of the scene with all its files."""
        whole = self.plan.provenance
        return whole if self.complete else whole.then(f"stopped after {self.rays_done:,} rays")

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """What the user should know."""
        notes = [*self.plan.notes, *self._copies_told(), *self.ledger.notes(self.plan.most_events)]
        if not self.complete:
            notes.append(
                f"{self.rays_done:,} of {self.rays_asked:,} rays were traced; every flux is scaled by {self.scale:.4g}"
            )
        return tuple(notes)

    @cached_property
    def ledger(self) -> Ledger:
        """The flux account."""
        plan, rows = self.plan, self.sums.ledger
        (escaped,), (terminated,) = self._entries(rows["escaped"]), self._entries(rows["terminated"])
        lost = zip(plan.loss_names, self._entries(rows["lost"]), self.sums.lost_at, strict=True)
        faces = plan.face_names
        return Ledger(
            plan.flux_unit,
            dict(zip(plan.source_names, self._entries(rows["emitted"]), strict=True)),
            escaped,
            dict(zip(faces, self._entries(rows["on_face"]), strict=False)),
            dict(zip(plan.medium_names, self._entries(rows["in_medium"]), strict=True)),
            terminated,
            tuple(
                Loss(reason, faces[at] if at is not None and at < len(faces) else "", entry.flux, entry.rays)
                for reason, entry, at in lost
                if entry.rays
            ),
            self.sums.imbalance,
        )

    @cached_property
    def effective_rays(self) -> float:
        """(Σw)²/Σw² over the rays of all sources, copies of a ray taken together: as many equal ones have the same error."""
        return self._effective[-1]

    @cached_property
    def effective_rays_by_source(self) -> dict[str, float]:
        """The same of each source."""
        return dict(zip(self.plan.source_names, self._effective[:-1], strict=True))

    @cached_property
    def _effective(self) -> list[float]:
        sum_, squares, *_ = (row.sum(axis=0) for row in self.sums.sources)
        return [float(s * s / q) if q > 0.0 else 0.0 for s, q in zip(sum_, squares, strict=True)]

    def _copies_told(self) -> Iterator[str]:
        """What is to be said of sets whose rays were given out several times."""
        dealing, done = self.plan.dealing, self.rays_done
        given = self.sums.ledger["emitted"][1].tolist()
        units = dealing.done(done).tolist()
        for stratum, sources in dealing.copied():
            names = ", ".join(self.plan.source_names[i] for i in sources)
            rays = sum(given[i] for i in sources)
            worth = min(self._effective[i] for i in sources)
            told = f"{names}: {rays:,} rays are copies of {units[stratum]:,} rays of the set"
            yield f"{told}, as good as {worth:,.0f} equal rays; errors are those of these, more copies do not lessen them"
        if dealing.strata > dealing.plain and len(given) > 1:
            yield f"the rays of all sources are as good as {self.effective_rays:,.0f} equal rays"

    def _entries(self, row: tuple[Array, Counts]) -> list[Entry]:
        flux, rays = row
        return [Entry(f * self.scale, n) for f, n in zip(flux.tolist(), rays.tolist(), strict=True)]

    # --- detectors -----------------------------------------------------------------------------------------------------

    def quantity_of(self, detector: str) -> Any:
        """What the detector of this name measured, whatever its kind.

        Raises
        ------
        UnknownNameError
            If there is no such detector; suggests the nearest.
        """
        number = self._numbers[detector]
        if number not in self._quantities:
            self._quantities[number] = self.plan.detections[number].read(self._recorded(number))
        return self._quantities[number]

    def _recorded(self, number: int) -> DetectorSums:
        if number not in self._read_from:
            self._read_from[number] = DetectorSums(self.plan, self.sums, number, self._origin)
        return self._read_from[number]

    def flux_of(self, detector: str) -> tuple[float, float]:
        """Flux of all light that a detector met, and its standard error [flux unit].

        A ray that comes to it again and again counts as one contribution. The error is NaN if no ray came.

        Raises
        ------
        UnknownNameError
            If there is no such detector; suggests the nearest.
        ArgumentError
            If it sums no flux: it is neither of rays, nor of illuminance, nor of intensity.

        Examples
        --------
        >>> import etendue as et
        >>> lid = {"name": "lid", "kind": "rays", "shape": {"kind": "rectangle", "width": 2, "height": 2}, "at": [0, 0, 1]}
        >>> scene = et.Scene(sources=[{"kind": "point", "flux": 60}], detectors=[lid])
        >>> flux, error = et.trace(scene, rays=10_000).flux_of("lid")          # a sixth: one face of a cube
        >>> bool(abs(flux - 10) < 3 * error), round(error, 2)                  # 60 lm · √(1/6 · 5/6/10 000)
        (True, 0.22)
        """
        number = self._numbers[detector]
        if not self.plan.detections[number].HAS_WHOLE:
            raise ArgumentError(f"flux:{detector}: name a detector of rays, illuminance or intensity.")
        counted = self._recorded(number).counted
        return float(counted.flux[-1]), float(counted.error[-1])

    @cached_property
    def rays(self) -> ByName[RaySet]:
        """The rays that crossed each ray collecting surface, with a wavelength each."""
        return self._all(IncidentRays, "ray collecting surface")

    @cached_property
    def intensity(self) -> ByName[Intensity]:
        """The far field of the light that left the scene [cd or W/sr]."""
        return self._all(FarFieldIntensity, "far-field detector")

    @cached_property
    def illuminance(self) -> ByName[IlluminanceMap]:
        """Illuminance by each illuminance detector [lx or W/m²]."""
        return self._all(GridIlluminance, "illuminance detector")

    @cached_property
    def images(self) -> ByName[LuminanceMap]:
        """Light images of diffuse surfaces [cd/m² or W/(m² sr)]."""
        return self._all(DiffuseLuminance, "light image")

    @cached_property
    def events(self) -> ByName[ScatterEvents]:
        """Where light was scattered diffusely; `luminance_map` shows it to any observer."""
        return self._all(ScatteredLight, "scatter recorder")

    @cached_property
    def _numbers(self) -> ByName[int]:
        return ByName("detector", {detection.name: i for i, detection in enumerate(self.plan.detections)})

    @cached_property
    def _quantities(self) -> dict[int, Any]:
        """What was read so far, by the number of the detector."""
        return {}

    @cached_property
    def _read_from(self) -> dict[int, DetectorSums]:
        """What it was read from."""
        return {}

    def _all(self, kind: type[Detection[T]], called: str) -> ByName[T]:
        names = [detection.name for detection in self.plan.detections if isinstance(detection, kind)]
        return ByName(called, {name: self.quantity_of(name) for name in names})

    @cached_property
    def relative_error(self) -> float:
        """The largest, over the detectors with cells, of the flux-weighted median relative standard error of its cells.

        NaN if a detector saw nothing yet, or the scene has none with cells.
        """
        pairs = zip(self.plan.detections, self.sums.cells, strict=True)
        dealing, sources, rays = self.plan.dealing, self.sums.sources, self.rays_done
        errors = [d.relative_error(d.counted(cells, sources, dealing, rays)) for d, cells in pairs if d.judged]
        return max(errors) if errors and all(error == error for error in errors) else float("nan")  # noqa: PLR0124

    def _flux_of(self, detection: Detection[Any]) -> dict[str, Any]:
        """The flux of all light that it met, as plain data for JSON."""
        if not detection.HAS_WHOLE:
            return {}
        flux, error = self.flux_of(detection.name)
        return {"flux": flux, "flux_error": error, "flux_unit": self.plan.flux_unit}

    def notes_of(self, detector: str) -> tuple[str, ...]:
        """What there is to say of what a detector saw, beside the `notes` of the whole trace."""
        return tuple(note for note in self.quantity_of(detector).notes if note not in self.notes)

    @property
    def _origin(self) -> Origin:
        """What all quantities have in common."""
        return Origin(self.plan.flux_unit, self.provenance, self.notes)

    # --- keeping -------------------------------------------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the result as an HDF5 file, whole or not at all; docs/formats/trace-results.md describes it.

        Raises
        ------
        ArgumentError
            If the folder does not exist.
        OSError
            If there is no room for it.
        """
        save_result(self.plan, self.sums, as_path(path))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> TraceResult:
        """Read a file that `save` wrote.

        Raises
        ------
        FormatError
            If it is none, or damaged.
        OSError
            If it cannot be opened.

        Examples
        --------
        >>> import etendue as et
        >>> from pathlib import Path
        >>> from tempfile import TemporaryDirectory
        >>> result = et.trace(et.Scene(sources=[{"kind": "point", "flux": 1}]), rays=1000)
        >>> with TemporaryDirectory() as folder:
        ...     result.save(Path(folder) / "result.h5")
        ...     TraceResult.load(Path(folder) / "result.h5").ledger == result.ledger
        True
        """
        return TraceResult(*load_result(as_path(path)))

    def to_dict(self) -> dict[str, Any]:
        """The result in figures, as plain data for JSON."""
        return {
            "scene": self.plan.scene_name,
            "fingerprint": self.plan.fingerprint,
            "seed": self.seed,
            "rays_asked": self.rays_asked,
            "rays_done": self.rays_done,
            "effective_rays": self.effective_rays,
            "effective_rays_by_source": self.effective_rays_by_source,
            "surfaces_met": self.sums.segments,
            "relative_error": self.relative_error,
            "ledger": self.ledger.to_dict(),
            "detectors": [
                {"name": d.name, "kind": d.KIND, "notes": list(self.notes_of(d.name))}
                | self._flux_of(d)
                | d.figures(self.quantity_of(d.name))
                for d in self.plan.detections
            ],
            "notes": list(self.notes),
        }
