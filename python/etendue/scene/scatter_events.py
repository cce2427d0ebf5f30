"""Where light was scattered in a scene: traced once, looked at from anywhere."""

from __future__ import annotations

import dataclasses
import warnings
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.errors import ArgumentError, SceneWarning
from etendue.quantities.arguments import require_fields
from etendue.quantities.fingerprint import fingerprint
from etendue.quantities.provenance import Provenance
from etendue.scatter.building import core_scene
from etendue.scene.compiling import Compiled, compile_scene
from etendue.scene.dealing import CellSums, Dealing
from etendue.scene.scene import Scene
from etendue.units import FluxUnit

Array = npt.NDArray[np.float64]

EVENT = np.dtype(
    [
        ("position", "<f8", 3),
        ("direction", "<f8", 3),
        ("flux", "<f8"),
        ("wavelength", "<f8"),
        ("ray", "<u8"),
        ("face", "<u4", 4),
        ("part", "<u4", 4),
        ("before", "<u8"),
        ("after", "<u8"),
    ]
)
"""A scatter as the core keeps it. The upper eight bits of `ray` are its depth: how often the events can be thinned before
those of this ray are dropped. Light leaves from up to four faces that coincide, the first of which scattered it; parts are
triangles of meshes. `before` and `after` hold the numbers of the solids on both sides, 16 bits each."""

RAY = np.uint64((1 << 56) - 1)
"""The bits of `ray` that hold the number of the ray."""


def geometry_of(compiled: Compiled) -> str:
    """Fingerprint of what stands in a scene: what light can meet, whatever its sources and detectors are."""
    return fingerprint({key: compiled.record[key] for key in ("media", "finishes", "solids", "faces")})


@dataclasses.dataclass(frozen=True, eq=False)
class ScatterEvents:
    """Light on its way to diffuse surfaces: every scatter of a trace, or those of some of its rays.

    `luminance_map` connects each of them to the eye of an observer: from one trace a map for any observer.

    Parameters
    ----------
    name : str
        Of the detector that kept them.
    rows : structured array, shape (n,)
        As the core keeps them (`EVENT`), not scaled; the rows of a ray follow each other.
    scale : float
        Flux that an event stands for over its flux in `rows`: rays asked for over rays done, over `share`.
    share : float
        Share of the rays whose events were kept, 1 or ½ or ¼ …
    rays : int
        Rays that were traced.
    dealing : Dealing
        Which source gave out which of them, and which are copies of one ray of a set.
    emitted : CellSums
        What the sources, and all of them, emitted.
    surface_names : tuple of str
        Of all faces of the scene.
    surfaces : tuple of str
        Names of the surfaces whose scatters were kept; empty: all.
    geometry : str
        Fingerprint of what stands in the scene.
    scene : Scene or None
        In which the light was scattered; None if it could not be written to the file that the events come from.
    flux_unit : {"lm", "W"}
    provenance : Provenance
    notes : tuple of str
        What the user should know.

    Examples
    --------
    >>> import etendue as et
    >>> lamp = {"kind": "surface", "shape": {"kind": "disk", "radius": 1}, "flux": 100, "toward": [0.3, 0, 1]}
    >>> paper = {"name": "paper", "shape": {"kind": "rectangle", "width": 60, "height": 40}, "at": [0, 0, 30],
    ...          "finish": {"kind": "lambertian", "reflectance": 0.8}}
    >>> scene = et.Scene(sources=[lamp], surfaces=[paper], detectors=[{"name": "scatter", "kind": "scatter"}])
    >>> events = et.trace(scene, rays=200_000, seed=3).events["scatter"]
    >>> events.position.shape == (len(events), 3), bool((events.position[:, 2] == 30).all())
    (True, True)
    >>> observers = [et.Observer(theta, 20, 500, target=(0, 0, 30)) for theta in (150, 120)]
    >>> one, other = et.luminance_map(events, observers, et.Screen(20, 20, 4, 4, "xy"))
    >>> bool(abs(one.values.mean() / other.values.mean() - 1) < 0.02)      # paper is as bright from everywhere
    True
    """

    name: str
    rows: npt.NDArray[Any]
    scale: float
    share: float
    rays: int
    dealing: Dealing
    emitted: CellSums
    surface_names: tuple[str, ...]
    surfaces: tuple[str, ...]
    geometry: str
    scene: Scene | None = None
    flux_unit: FluxUnit = "lm"
    provenance: Provenance = dataclasses.field(default_factory=Provenance)
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Name, events and origin."""
        return f"<ScatterEvents {self.name!r}: {len(self):,} of {self.rays:,} rays from {self.provenance.source}>"

    def __len__(self) -> int:
        """Number of events."""
        return len(self.rows)

    @property
    def position(self) -> Array:
        """Where light was scattered, shape (n, 3) [mm]."""
        return self._column("position")

    @property
    def direction(self) -> Array:
        """Where it was going before, unit vectors, shape (n, 3)."""
        return self._column("direction")

    @property
    def flux(self) -> Array:
        """What each event stands for of the light that arrived, shape (n,) [flux unit]."""
        return self._column("flux") * self.scale

    @property
    def wavelength(self) -> Array:
        """Shape (n,) [nm]."""
        return self._column("wavelength")

    @property
    def ray(self) -> npt.NDArray[np.int64]:
        """Numbers of the rays, in ascending order, shape (n,): events of one ray are not independent of each other."""
        return (self.rows["ray"] & RAY).astype(np.int64)

    @property
    def surface(self) -> npt.NDArray[np.int64]:
        """Where in `surface_names` the surfaces stand that scattered the light, shape (n,)."""
        return self.rows["face"][:, 0].astype(np.int64)

    def flux_by_surface(self) -> dict[str, float]:
        """Flux that arrived at each diffuse surface, time after time if it came back [flux unit].

        Examples
        --------
        >>> import etendue as et
        >>> ball = {"name": "ball", "shape": {"kind": "sphere", "radius": 5}, "finish": {"kind": "lambertian",
        ...         "reflectance": 0.5}}
        >>> lamp = {"kind": "point", "flux": 1, "at": [1, 2, 0]}
        >>> traced = et.trace(et.Scene(sources=[lamp], surfaces=[ball], detectors=[{"kind": "scatter"}]), rays=100_000)
        >>> round(traced.events.only.flux_by_surface()["ball"], 1)         # 1 + 1/2 + 1/4 + …
        2.0
        """
        sums = np.bincount(self.surface, self.flux, len(self.surface_names))
        return {name: float(flux) for name, flux in zip(self.surface_names, sums, strict=True) if flux > 0.0}

    def replace(self, **changes: Any) -> ScatterEvents:
        """A copy with some fields changed (`dataclasses.replace`), as the scene if it comes without or has moved."""
        require_fields(changes, type(self))
        return dataclasses.replace(self, **changes)

    @cached_property
    def core(self) -> _core.Scene:
        """What stands in the scene, as the core takes it.

        Raises
        ------
        ArgumentError
            If there is no scene, or another one than that in which the light was scattered.
        SceneError
            If files that the scene names are missing.
        """
        if self.scene is None:
            raise ArgumentError(
                f"the scatter events of {self.name!r} come without their scene, parts of which lived in memory only: "
                "give it in Python: events.replace(scene=scene)."
            )
        with warnings.catch_warnings():
            # What is doubtful about it was told when it was traced.
            warnings.simplefilter("ignore", SceneWarning)
            compiled = compile_scene(self.scene.replace(sources=(), detectors=()))
        if geometry_of(compiled) != self.geometry:
            raise ArgumentError(
                f"the scatter events of {self.name!r} are of another scene, or a file that it names has changed: "
                "trace it again, or, in Python, give the scene as it was: events.replace(scene=scene)."
            )
        return core_scene(compiled.record)

    def _column(self, name: str) -> Array:
        return np.asarray(self.rows[name])
