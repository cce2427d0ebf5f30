"""The compiled core. Arrays in, arrays out; lengths in mm, angles in radians, fluxes as stored."""

import os
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Any, Literal, TypeAlias, TypedDict, final

import numpy as np
import numpy.typing as npt

__all__ = [
    "BrightSpots",
    "Bsdf",
    "Dealing",
    "FarField",
    "FieldRays",
    "Glints",
    "Guide",
    "LightField",
    "RayTable",
    "RingSource",
    "Scene",
    "StoredBytes",
    "Survey",
    "TreeMemory",
    "batch_size",
    "chord_error",
    "cone_sums",
    "count_rays",
    "cross_parts",
    "deal_parts",
    "deepest",
    "draw_wavelengths",
    "index_arrange",
    "index_count",
    "index_leaf",
    "index_place",
    "index_sums",
    "kept_ray_keys",
    "look_at_events",
    "look_at_scene",
    "losses",
    "mesh_facets",
    "mesh_shells",
    "most_solids",
    "node_values",
    "open_edges",
    "polya_average",
    "polya_evidence",
    "polya_posterior",
    "ray_keys",
    "rays_of_part",
    "read_colours",
    "read_pieces",
    "read_rays",
    "scan",
    "scan_colours",
    "scene_crossings",
    "select_subset",
    "smooth_normals",
    "trace_trails",
    "weld",
    "weld_mesh",
    "work_unit",
]

_Floats: TypeAlias = npt.NDArray[np.float64]
_Progress: TypeAlias = Callable[[int], Any]
_Media: TypeAlias = tuple[float, float, float]
"""Wavelength [nm], refractive index in front and behind."""

@final
class Bsdf:
    def __new__(cls, record: dict[str, Any]) -> Bsdf: ...
    def evaluate(self, incident: _Floats, scattered: _Floats, media: _Media) -> _Floats: ...
    def pdf(self, incident: _Floats, scattered: _Floats, media: _Media) -> _Floats: ...
    def shares(self, incident: _Floats, media: _Media) -> _Floats: ...
    def sample(self, incident: tuple[float, float, float], n: int, seed: int, media: _Media) -> _Floats: ...
    def sample_each(self, incident: _Floats, seed: int, media: _Media) -> _Floats: ...
    def facts(self) -> tuple[list[bool], bool]: ...

class _Tally(TypedDict):
    rays: int
    defects: list[int]
    dark: int
    flux: float
    flux_squared: float
    norm_error: float

class _Moments(TypedDict):
    flux_range: list[float]
    bounds: list[list[float]]
    weighted_position: list[float]
    weighted_direction: list[float]
    weighted_outer: list[float]
    focus_rhs: list[float]

class _View(TypedDict):
    eye: Sequence[float]
    target: Sequence[float]
    right: Sequence[float]
    up: Sequence[float]
    normal: Sequence[float]
    width: float
    height: float
    columns: int
    rows: int

class _Cone(TypedDict):
    view: _View
    acceptances: Sequence[float]
    disk: float | None

class _Part(TypedDict):
    shape: str
    centre: Sequence[float]
    x: Sequence[float]
    y: Sequence[float]
    z: Sequence[float]
    size: Sequence[float]
    focus: Sequence[float]
    beam: Sequence[float]

class _FieldPart(TypedDict):
    part: _Part
    cells: Sequence[int]
    ratio: npt.NDArray[np.float32]
    deviation: npt.NDArray[np.float32]
    space: _Floats | None
    direction: _Floats | None
    level: float
    space_error: _Floats | None
    direction_error: _Floats | None
    cells_left: Sequence[float]
    within_left: Sequence[float]

class _Counts(TypedDict):
    grid: tuple[npt.NDArray[np.uint32] | _Floats, _Floats | None]
    space: tuple[npt.NDArray[np.uint32] | _Floats, _Floats | None]
    direction: tuple[npt.NDArray[np.uint32] | _Floats, _Floats | None]
    weight: float | None
    kept_part: npt.NDArray[np.int64]
    kept_weight: _Floats
    kept: _Floats
    unmet_rays: int
    unmet_flux: float
    tally: _Tally

_Entries: TypeAlias = tuple[_Floats, npt.NDArray[np.uint64]]

class _Ledger(TypedDict):
    emitted: _Entries
    escaped: _Entries
    on_face: _Entries
    in_medium: _Entries
    terminated: _Entries
    lost: _Entries
    lost_at: list[int | None]
    segments: int

_Numbers: TypeAlias = npt.NDArray[np.uint64]
_ConeCells: TypeAlias = tuple[_Floats, _Floats, _Numbers]
_Cells: TypeAlias = tuple[_Floats, _Floats, _Numbers, _Floats]
_Units: TypeAlias = tuple[npt.NDArray[np.uint32], _Numbers, _Floats, _Floats]
_CellTally: TypeAlias = tuple[_Cells, _Units]

class _WorkSums(TypedDict):
    batches: tuple[int, int]
    ledger: _Ledger
    tallies: list[_CellTally]
    emitted: _CellTally
    records: list[_Floats]
    events: list[tuple[npt.NDArray[np.uint64], int]]
    arrivals: _Floats
    rays: int
    imbalance: float

class _Colours(TypedDict):
    flux: _Floats
    mean: _Floats
    low: _Floats
    high: _Floats
    unknown: tuple[float, int]

@final
class StoredBytes:
    """Bytes of a file, read where they are asked for: never mapped, so that a file that shrinks is an error and no crash.

    Whatever reads them raises `FormatError` if the file did not give them, and warns once, with `ChangedFileWarning`, if its
    size or time of change is not what it was when it was opened.
    """

    def __new__(cls, path: str | os.PathLike[str], start: int, len: int) -> StoredBytes: ...
    def __len__(self) -> int: ...
    def size(self) -> int:
        """Size of the whole file when it was opened."""

    def named(self, name: str) -> StoredBytes:
        """The same bytes, of what messages call by this name."""

    def read(self, start: int, stop: int) -> npt.NDArray[np.uint8]:
        """Bytes ``start..stop``, counted from the first."""

    def check(self) -> None:
        """Raise or warn as after a pass."""

@final
class RayTable:
    """Ray records over the bytes of an array, or of a file."""

    def __new__(
        cls,
        records: npt.NDArray[np.uint8] | StoredBytes,
        stride: int,
        position: int | None,
        direction: int,
        flux: int,
        double: bool,
        length_scale: float,
        colour: tuple[int, str, float] | None = None,
    ) -> RayTable: ...
    def __len__(self) -> int: ...

@final
class RingSource:
    """Concentric Lambertian rings; each ring is (inner [mm], outer [mm], flux [lm], rays per run)."""

    def __new__(cls, rings: Sequence[tuple[float, float, float, int]], runs: int, seed: int) -> RingSource: ...
    def __len__(self) -> int: ...

@final
class LightField:
    """The light that leaves the parts of a carrier surface, ready to be read, looked at and drawn from."""

    def __new__(cls, parts: Sequence[_FieldPart]) -> LightField: ...
    def flux(self) -> list[float]:
        """Flux of each part: ∫ L dU."""

    def luminance(self, points: _Floats, directions: _Floats, threads: int | None = None) -> tuple[_Floats, _Floats]:
        """Luminance and its standard deviation along lines given by points (n, 3) and directions (n, 3)."""

    def cell_means(self, part: int, threads: int | None = None) -> tuple[_Floats, _Floats]:
        """Mean luminance of each cell of a part, last coordinate fastest, and mean of its standard deviation."""

    def at(self, part: int, coordinates: _Floats) -> tuple[_Floats, _Floats]:
        """Luminance and its standard deviation at coordinates (n, 4) of a part."""

    def intensity(self, directions: _Floats, side: int, threads: int | None = None) -> _Floats:
        """Intensity in each direction (n, 3), by a midpoint rule of side² points on every part."""

    def look(self, view: _View, samples: int, threads: int | None = None) -> tuple[_Floats, _Floats]:
        """Mean luminance of each pixel and its standard deviation, shape (rows, columns)."""

@final
class FieldRays:
    """A number of equal rays drawn from a field, with the field's flux."""

    def __new__(cls, field: LightField, rays: int, seed: int) -> FieldRays: ...
    def __len__(self) -> int: ...

@final
class Scene:
    """A scene, ready to be traced and to be looked at; `record` is what `etendue.scene.compile_scene` makes.

    Its faces come as columns: ``record["faces"]`` is a `etendue.scene.face_rows.FaceRows`.
    """

    def __new__(cls, record: dict[str, Any]) -> Scene: ...
    def with_far_fields(self, nodes: list[FarField]) -> Scene:
        """The same scene, whose detectors of the far field share rays by these nodes, in their order."""

    def may_focus(self) -> bool:
        """Whether light can reach a diffuse surface in a way that lines of sight find by chance, or not at all."""

    def window(self, view: _View) -> list[tuple[int, int]]:
        """Rows and columns of a view outside of which its lines of sight meet nothing: first, and after the last."""

@final
class FarField:
    """Nodes of a far field [rad]: rows of γ, and the nodes C of each row."""

    def __new__(cls, gamma: list[float], c: list[list[float]]) -> FarField: ...
    def __len__(self) -> int:
        """Number of nodes, and the cell of all rays together."""

    def add(
        self,
        direction: _Floats,
        flux: _Floats,
        sums: _Floats,
        squares: _Floats,
        rays: npt.NDArray[np.uint64],
    ) -> None:
        """Add rays to Σ w, Σ w² and the number of rays of each cell."""

@final
class Glints:
    """Where in their pixels the sources of a scene are seen that are small there: as many paths again look for them."""

    def __new__(cls, scene: Scene, view: _View, most_events: int, threads: int | None = None) -> Glints: ...
    def pixels(self) -> int:
        """Number of pixels that have some."""

@final
class BrightSpots:
    """Small places of diffuse surfaces that much light comes from, from scatter events (n, 15), if there are such."""

    def __new__(cls, scene: Scene, events: npt.NDArray[np.uint64]) -> BrightSpots: ...
    def exist(self) -> bool:
        """Whether there are such places."""

@final
class Guide:
    """Directions in which lines of sight go on from diffuse surfaces by preference, from the arrivals of a trace."""

    def __new__(cls, scene: Scene, arrivals: _Floats) -> Guide: ...

@final
class Survey:
    """The diffuse surfaces of a scene as patches whose light is known beforehand, for `look_at_scene`."""

    def __new__(cls, scene: Scene, seed: int, most_events: int, threads: int | None = None) -> Survey: ...
    def patches(self) -> tuple[int, float]:
        """Number of patches, and the share of them that can be used."""

_Source: TypeAlias = RayTable | RingSource | FieldRays

def read_rays(source: _Source, start: int, stop: int) -> tuple[_Floats, _Floats, _Floats]:
    """Rays ``start..stop`` as (position (n, 3) [mm], unit direction (n, 3), flux (n,))."""

def read_pieces(source: _Source, ranges: Sequence[tuple[int, int]]) -> tuple[_Floats, _Floats, _Floats]:
    """The rays of ranges (start, stop), one after another, as of `read_rays`."""

def ray_keys(position: _Floats, direction: _Floats) -> npt.NDArray[np.uint64]:
    """A key of each ray's place and direction (n, 3), to single precision: the same for copies, another for others."""

def kept_ray_keys(
    source: _Source, ranges: Sequence[tuple[int, int]], every: int, threads: int | None = None
) -> tuple[npt.NDArray[np.uint64], _Floats]:
    """Keys that are multiples of `every`, and the flux, of the rays of ranges (start, stop) that have flux."""

def weld(vertices: _Floats) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    """Of vertices (n, 3) one at each place, in rising order of x, y and z, and for each vertex the number of its place."""

def weld_mesh(
    vertices: _Floats, triangles: npt.NDArray[np.uint32]
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    """The vertices that triangles (m, 3) with an area use, one at each place, by x, y and z; those triangles."""

def mesh_facets(
    vertices: _Floats, triangles: npt.NDArray[np.uint32], limits: Sequence[float]
) -> tuple[_Floats, _Floats]:
    """Area of each triangle (m,), and the largest angle [turns] between it and a neighbour, of those between two limits."""

def chord_error(vertices: _Floats, normals: _Floats, triangles: npt.NDArray[np.uint32]) -> float:
    """Largest distance between triangles (m, 3) and the surface whose unit normals (n, 3) they have at their corners."""

def open_edges(triangles: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Edges (k, 2) that are not shared by two triangles with opposite senses, in rising order."""

def mesh_shells(triangles: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """The number of the shell of each triangle (m,), from 0: triangles that share an edge are of one."""

def smooth_normals(
    vertices: _Floats, triangles: npt.NDArray[np.uint32], least: float
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32], _Floats]:
    """Which vertex each new one was, triangles over these, and unit normals: means over those of at least this cosine."""

def read_colours(source: _Source, start: int, stop: int) -> _Floats:
    """What the records of rays ``start..stop`` state of their colours, as they were opened, shape (n,); (0,) if nothing."""

def draw_wavelengths(
    wavelengths: Sequence[float], shares: Sequence[float], seed: int, start: int, stop: int
) -> _Floats:
    """Wavelengths [nm] of rays ``start..stop`` of a stream that have nothing but a spectrum in common, shape (n,)."""

def scan(source: _Source, threads: int | None = None, progress: _Progress | None = None) -> tuple[_Tally, _Moments]:
    """One pass over a source."""

def scan_colours(source: _Source, threads: int | None = None, progress: _Progress | None = None) -> _Colours:
    """The flux of a source by what its records say of the colour of each ray."""

def cone_sums(
    source: _Source,
    cones: Sequence[_Cone],
    threads: int | None = None,
    progress: _Progress | None = None,
) -> tuple[list[_ConeCells], _Tally]:
    """For each cone (Σ w, Σ w², rays), each of shape (acceptances, rows, columns), and the tally."""

def index_leaf() -> int:
    """Rays of a leaf of the ray index."""

def index_count(
    source: _Source, side: int, threads: int | None = None, progress: _Progress | None = None
) -> tuple[npt.NDArray[np.uint64], _Tally]:
    """Usable rays in each of the 2·side² cells of direction, and the tally."""

def index_place(
    source: _Source,
    side: int,
    starts: npt.NDArray[np.uint64],
    out: npt.NDArray[np.uint8],
    threads: int | None = None,
    progress: _Progress | None = None,
) -> bool:
    """Records of the usable rays, cell by cell, into `out`; False if the rays are not those that were counted."""

def index_arrange(
    records: RayTable,
    side: int,
    starts: npt.NDArray[np.uint64],
    centre: Sequence[float],
    threads: int | None = None,
    progress: _Progress | None = None,
) -> npt.NDArray[np.float32]:
    """Puts the records of a writable table in the order of their leaves; returns the leaves' boxes, shape (leaves, 8)."""

def index_sums(
    records: RayTable,
    side: int,
    starts: npt.NDArray[np.uint64],
    bounds: npt.NDArray[np.float32],
    centre: Sequence[float],
    cones: Sequence[_Cone],
    threads: int | None = None,
    progress: _Progress | None = None,
) -> list[tuple[_ConeCells, int]]:
    """For each cone (Σ w, Σ w², rays), each of shape (acceptances, rows, columns), and the rays looked at."""

def count_rays(
    source: _Source,
    parts: Sequence[_Part],
    grids: Sequence[tuple[Sequence[int], Sequence[int]]],
    held_out: float,
    kept: float,
    seed: int,
    threads: int | None = None,
    progress: _Progress | None = None,
) -> _Counts:
    """One pass: (Σ w, Σ w²) per cell of three grids; cells by fold (fitted, held out), part, coordinates.

    For each part the halvings of the four coordinates, and those of the fine grids over place and direction.

    Where all rays have one weight, the first of each pair counts rays and the second is None.
    """

def cross_parts(parts: Sequence[_Part], position: _Floats, direction: _Floats) -> tuple[npt.NDArray[np.int64], _Floats]:
    """For each ray the first part its line leaves (-1: none), and its coordinates (n, 4) there."""

def rays_of_part(part: _Part, coordinates: _Floats) -> tuple[_Floats, _Floats]:
    """Points (n, 3) and directions (n, 3) at coordinates (n, 4) of a part."""

def node_values(means: _Floats, shape: Sequence[int]) -> _Floats:
    """Values at the centres of cells whose linear interpolation has these means over the cells."""

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

def polya_average(
    depths: Sequence[int],
    weight: _Floats,
    weight_squared: _Floats | None,
    base: Sequence[tuple[int, _Floats]] | None,
    concentration: float,
    positions: Sequence[Sequence[int]],
    threads: int | None = None,
) -> tuple[_Floats, _Floats, list[float]]:
    """Averages over trees whose cells are moved cyclically by so many steps along each axis: as `polya_posterior`.

    Means of the mean and of the mean square over the trees, their cells moved back, and ln evidence of each tree.
    """

def polya_evidence(
    depths: Sequence[int],
    weight: _Floats,
    weight_squared: _Floats | None,
    base: _Masses | None,
    concentration: float,
    threads: int | None = None,
) -> float:
    """The logarithm of the evidence alone."""

@final
class TreeMemory:
    """A context in which trees leave their memory to those that are grown after them, in the whole process."""

    def __new__(cls) -> TreeMemory: ...
    def __enter__(self) -> None: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None, /
    ) -> None: ...

def select_subset(start: int, stop: int, n: int, k: int, taken: int, seed: int) -> npt.NDArray[np.uint64]:
    """Indices in ``start..stop`` of a random k-subset of n, of which `taken` were taken before."""

def deal_parts(start: int, stop: int, parts: int, seed: int) -> npt.NDArray[np.uint32]:
    """The part of each ray in ``start..stop``."""

@final
class Dealing:
    """The rays of a run, dealt to sources: their fluxes, and number and length of the set that each gives out, if any."""

    def __new__(cls, fluxes: Sequence[float], sets: Sequence[tuple[int, int] | None], rays: int) -> Dealing: ...
    def strata(self) -> int:
        """Number of strata: what sources draw, each set beside other sources, and each of which copies are given out."""

    def plain(self) -> int:
        """Number of strata without copies, which are the first ones."""

    def sources(self) -> list[tuple[int, int]]:
        """Stratum of each source, and its rays in the whole run."""

    def done(self, done: int) -> list[int]:
        """Units of each stratum among the first `done` rays."""

    def units(self, rays: npt.NDArray[np.uint64]) -> tuple[_Numbers, _Numbers, _Floats]:
        """By the rays' numbers: the unit of each, its stratum, and its flux in the whole run over that of the ray."""

    def join(self, open: _Units, copies: _Units, done: int) -> tuple[npt.NDArray[np.uint32], _Numbers, _Cells, _Units]:
        """Adds units of rays with copies to open ones, when `done` rays are given out.

        Cell, stratum and (Σ w, Σ w², units, Σ w v) of what grows, each cell of a stratum once; and the units of which more
        copies may come.
        """

def losses() -> list[str]:
    """Why rays are lost, in the order of a ledger."""

def batch_size() -> int:
    """Rays of a batch."""

def work_unit(
    scene: Scene,
    rays: int,
    seed: int,
    most_events: int,
    first: int,
    last: int,
    threads: int | None = None,
    each: int | None = None,
) -> _WorkSums:
    """Traces batches ``first..last`` of a run of `rays` rays; batches have ``batch_size()`` rays, or `each`.

    Of the ledger each entry is (flux, rays), by source, face, medium or reason. Tallies are of each detector: (Σ w, Σ w²,
    rays that contributed) of its cells, by rays without copies, and (cell, unit, Σ w) of rays with copies; `emitted` is the
    same of the flux of each source, and of all of them at the end. Records are rows of position [mm], direction, flux,
    wavelength [nm], shape (n, 8); events are rows of scatter events, shape (n, 15), and how often they were thinned;
    arrivals are rows of point, unit vector to where light came from, number of the face, and that of the family,
    shape (n, 8).
    """

def look_at_scene(
    scene: Scene,
    view: _View,
    paths: int,
    seed: int,
    most_events: int,
    left: Literal["nothing", "caustics", "scattered"],
    first: int,
    last: int,
    threads: int | None = None,
    survey: Survey | None = None,
    shared: float | None = None,
    guide: Guide | None = None,
    glints: Glints | None = None,
    spots: BrightSpots | None = None,
) -> tuple[_Floats, _Floats, _Floats, _Floats, _Floats, _Floats, tuple[float, float]]:
    """What lines of sight find in each of the passes ``first..last`` of `paths` paths, each array (passes, rows, columns).

    Mean luminance, that of the light that drawn directions find behind smooth surfaces, deviation of the sources, and
    shares of the paths that meet a smooth surface first, and that see a diffuse one directly; luminance of the light
    that was scattered on its way; and the sums over passes and pixels of the mean weights that paths still had when they
    were given up, as they had met `most_events` surfaces, and when they were lost, as the solids they were in
    contradicted the face they met.

    `left`: light that is not looked for, because rays traced forwards find it. Caustics: what reaches a diffuse surface
    through smooth ones, and from there the eye directly or over other diffuse ones. Scattered: all that reaches the eye
    directly from a diffuse surface. `shared`: rays forwards for each path of a pixel, with which caustics are shared; they
    are left out altogether without. `guide`, `glints`, `spots`: where paths look for light that they meet by chance only.
    """

def look_at_events(
    scene: Scene,
    events: npt.NDArray[np.uint64],
    brought: _Floats,
    view: _View,
    threads: int | None = None,
) -> _Cells:
    """The light image of stored scatter events (n, 15), as cells; the rows of a ray follow each other.

    `brought` is the flux of the ray of each, its copies included.
    """

def most_solids() -> int:
    """Solids that a scene has at most."""

def deepest() -> int:
    """How often scatter events are thinned at most."""

def trace_trails(scene: Scene, rays: int, seed: int, most_events: int, far: float) -> list[_Floats]:
    """The points (n, 3) that each ray passes; those that leave the scene end after `far`."""

def scene_crossings(
    scene: Scene, points: _Floats, directions: _Floats
) -> tuple[npt.NDArray[np.uint64], npt.NDArray[np.uint32], _Floats]:
    """Every crossing of lines with faces ahead: number of the line, face, distance."""
