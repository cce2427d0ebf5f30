"""What a lamp shows the camera from each position: light fields, rays, scenes, and luminance as a function."""

from __future__ import annotations

import abc
import math
import os
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import numpy.typing as npt

from etendue.concurrency import in_order
from etendue.errors import ArgumentError
from etendue.instruments.near_field.field_errors import field_errors
from etendue.instruments.near_field.positions import ArmPositions
from etendue.lightfield.fit_cache import fit_or_recall
from etendue.lightfield.light_field import LightField
from etendue.lightfield.pilot_sample import pilot_sample
from etendue.luminance.framing import centre_of_light, probe
from etendue.luminance.looking import look_at_field
from etendue.luminance.methods import PathTracing
from etendue.luminance.opening import open_source
from etendue.luminance.scene_map import SeenScene, look_at_scene
from etendue.quantities.arguments import require, require_number
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_stream import RayStream
from etendue.scene import Scene
from etendue.scene.framing import finite_boxes
from etendue.scene.sources.from_files import Field, Rays
from etendue.units import FluxUnit

Array = npt.NDArray[np.float64]
Luminance = Callable[[Array, Array], Array]
"""Of lines: points (n, 3) [mm] and unit vectors (n, 3) in which the light travels, to luminance (n,)."""

Source = LightField | RayStream | Scene | str | os.PathLike[str] | Luminance

NEARLY_ALL = 0.999
"""Share of the light of rays and fields that the camera's image shows; the photometer sees all."""

MARGIN = 1.05
"""How much larger than that the image is."""

LINES = 1 << 16
"""Lines of sight of an image at least: the edges of lamps are cut by pixels."""

LEAST = 4
"""Of a pixel."""

OF_THE_FIELD = (
    "the lamp is a light field: errors of the readings and of their integral are what they vary by between sets of as many "
    "rays; what the field smooths comes on top"
)

FEW = 1 << 12
"""Rays of a source that tell where it is."""


class Lamp(abc.ABC):
    """A source that can be looked at from anywhere outside of it.

    Parameters
    ----------
    name : str
        For people.
    flux_unit : {"lm", "W"}
    provenance : Provenance
    notes : tuple of str
        What all that is made of the lamp should tell.

    Examples
    --------
    >>> lamp_of(lambda points, k: np.where(k[:, 2] > 0.0, 1e4, 0.0), size=2.0).reach((0.0, 0.0, 0.0))
    (1.0, 1.0)
    """

    name: str
    flux_unit: FluxUnit = "lm"
    provenance: Provenance
    notes: tuple[str, ...] = ()

    @abc.abstractmethod
    def centre(self) -> tuple[float, float, float]:
        """The point about which the arm should turn [mm]."""

    @abc.abstractmethod
    def reach(self, centre: Sequence[float]) -> tuple[float, float]:
        """How far from a point the lines of nearly all light pass, and those of all of it [mm]."""

    def errors_of_readings(self, stops: ArmPositions, light: Array, light_error: Array) -> tuple[Array, float]:
        """Standard errors of the readings and of their integral over the sphere; independent unless a lamp knows better.

        Parameters
        ----------
        stops : ArmPositions
            Where they were taken.
        light, light_error : array, shape (n,)
            Readings, and their errors as if all pixels were independent.

        Returns
        -------
        tuple of array, shape (n,), and float
            In the same unit, and in that times sr.
        """
        return np.broadcast_to(light_error, light.shape), float(np.linalg.norm(stops.weight * light_error))

    @abc.abstractmethod
    def images(self, observers: Sequence[Observer], screen: Screen) -> Iterator[tuple[Array, Array | None]]:
        """Mean luminance of each pixel and, where it is known, its sampling error; image by image, shape (rows, columns)."""


class FieldLamp(Lamp):
    """A light field.

    Parameters
    ----------
    field : LightField
    samples : int, optional
        Points within each pixel.
    seed : int
        Of rays drawn anew.
    threads : int, optional

    Examples
    --------
    >>> import etendue as et
    >>> rings = et.RingSource(rays=2000)
    >>> lamp = FieldLamp(et.LightField.fit(rings, et.Disk(radius=30), depths=(2, 2, 2, 2)), None, 1, None)
    >>> round(lamp.reach((0.0, 0.0, 0.0))[1])
    30
    """

    def __init__(self, field: LightField, samples: int | None, seed: int, threads: int | None) -> None:
        self._field, self._samples, self._seed, self._threads = field, samples, seed, threads
        self._some = probe(field)
        self.name, self.flux_unit = field.provenance.source, field.flux_unit
        self.provenance, self.notes = field.provenance, (*field.notes, OF_THE_FIELD)

    def centre(self) -> tuple[float, float, float]:
        """Where the light comes from."""
        return centre_of_light(self._some)

    def reach(self, centre: Sequence[float]) -> tuple[float, float]:
        """From some rays that are drawn from the field."""
        off = np.linalg.norm(np.cross(self._some.position - np.asarray(centre), self._some.direction), axis=1)
        return float(np.quantile(off, NEARLY_ALL)), float(off.max())

    def errors_of_readings(self, stops: ArmPositions, light: Array, light_error: Array) -> tuple[Array, float]:
        """All positions see the same rays."""
        return field_errors(self._field, stops, light, light_error, self._seed, self._threads)

    def images(self, observers: Sequence[Observer], screen: Screen) -> Iterator[tuple[Array, Array | None]]:
        """By quadrature over each pixel, with the standard error of the field there, beside which that of the quadrature is
        nothing."""  # noqa: D205, D209 - one sentence
        for observer in observers:
            samples = self._samples or lines_per_pixel(screen)
            seen = look_at_field(self._field, observer, screen, samples, self._threads)
            yield seen.values, seen.standard_error


class SceneLamp(Lamp):
    """A scene: lines of sight are followed through its optics.

    Parameters
    ----------
    scene : Scene
    samples : int, optional
        Lines of sight per pixel.
    seed : int
    threads : int, optional

    Examples
    --------
    >>> import etendue as et
    >>> disk = {"kind": "surface", "shape": {"kind": "disk", "radius": 3}, "at": [1, 0, 2], "flux": 10}
    >>> SceneLamp(et.Scene(sources=[disk]), None, 1, None).centre()
    (1.0, 0.0, 2.0)
    """

    def __init__(self, scene: Scene, samples: int | None, seed: int, threads: int | None) -> None:
        self._scene, self._samples, self._seed, self._threads = (
            SeenScene(scene, threads=threads),
            samples,
            seed,
            threads,
        )
        compiled = self._scene.compiled
        self.name, self.flux_unit = scene.name or "the scene", compiled.flux_unit
        self.provenance = Provenance(scene.name or "scene", "scene")
        self.notes = (*compiled.notes, *self._scene.notes)
        boxes = finite_boxes(compiled.record["faces"]) + finite_boxes(compiled.record["sources"]) + _starts(scene)
        if not boxes:
            raise ArgumentError(f"{self.name}: nothing in the scene has an end; an instrument cannot go around it.")
        self._corners = np.concatenate(boxes)

    def centre(self) -> tuple[float, float, float]:
        """The middle of the box about all that has an end."""
        low, high = self._corners.min(axis=0), self._corners.max(axis=0)
        x, y, z = (float(v) for v in (low + high) / 2.0)
        return (x, y, z)

    def reach(self, centre: Sequence[float]) -> tuple[float, float]:
        """To the farthest corner."""
        far = float(np.linalg.norm(self._corners - np.asarray(centre), axis=1).max())
        return far, far

    def images(self, observers: Sequence[Observer], screen: Screen) -> Iterator[tuple[Array, Array | None]]:
        """By lines of sight."""
        lines = self._samples or lines_per_pixel(screen)

        def image(numbered: tuple[int, Observer]) -> tuple[Array, Array | None]:
            number, observer = numbered
            # Lines of its own for each view: what they miss of a small lamp averages out.
            seed = int(np.random.SeedSequence((self._seed, 8, number)).generate_state(1)[0])
            how = PathTracing(rays_per_pixel=lines, seed=seed)
            (lmap,) = look_at_scene(self._scene, [(observer, screen)], how, threads=self._threads)
            return lmap.values, lmap.standard_error

        yield from in_order(image, enumerate(observers), self._threads or os.cpu_count() or 1)


def _starts(scene: Scene) -> list[Array]:
    """Where some rays of those sources start that have no shape of their own, in the world."""
    found = []
    for source in scene.sources:
        if isinstance(source, Rays):
            rays = pilot_sample(source.ray_stream(scene.files), FEW)
        elif isinstance(source, Field):
            field = source.field if source.file is None else LightField.load(scene.files.find(source.file))
            if field is None:  # which its checks exclude
                continue
            rays = field.sample(FEW)
        else:
            continue
        frame = source.frame()
        found.append(frame.origin + rays.position @ frame.axes.T)
    return found


class FunctionLamp(Lamp):
    """Luminance as a function of points and directions.

    Parameters
    ----------
    luminance : callable
    size : number
        Diameter of a ball that holds the lamp [mm].
    samples : int, optional
        Lines through each pixel, at random within a lattice.
    seed : int

    Examples
    --------
    >>> even = FunctionLamp(lambda points, k: np.full(len(points), 7.0), 2.0, 4, 1)
    >>> values, _ = next(even.images([Observer(0, 0, 50)], Screen(1, 1, 2, 2)))
    >>> values.tolist()
    [[7.0, 7.0], [7.0, 7.0]]
    """

    def __init__(self, luminance: Luminance, size: float | None, samples: int | None, seed: int) -> None:
        if size is None:
            raise ArgumentError(
                "of a function it is not known how large the lamp is: state `size`, its diameter in mm."
            )
        require_number(size, "size", "the diameter of the lamp in mm")
        if not 0.0 < size < math.inf:
            raise ArgumentError(f"size is {size:g}; give the diameter of the lamp in mm, above 0.")
        self._luminance, self._size, self._seed = luminance, size, seed
        self._samples = samples
        self.name, self.provenance = "a function", Provenance("function")

    def centre(self) -> tuple[float, float, float]:
        """The origin."""
        return (0.0, 0.0, 0.0)

    def reach(self, centre: Sequence[float]) -> tuple[float, float]:
        """As stated, about the origin."""
        far = 0.5 * self._size + float(np.linalg.norm(centre))
        return far, far

    def images(self, observers: Sequence[Observer], screen: Screen) -> Iterator[tuple[Array, Array | None]]:
        """By lines at random places in each cell of a lattice in each pixel, with errors by what neighbouring cells differ.

        That is the spread within both cells, and what their means differ on top of it: no less than the error where a lamp
        has edges, and up to twice as much.
        """
        n = math.ceil(math.sqrt(self._samples or lines_per_pixel(screen)))
        width, height = screen.width / screen.columns, screen.height / screen.rows
        for number, observer in enumerate(observers):
            rng = np.random.Generator(np.random.Philox(np.random.SeedSequence((self._seed, 2, number))))
            right, up, _ = screen.axes(observer)
            total, variance = np.zeros(screen.shape), np.zeros(screen.shape)
            last = total
            for i in range(n):
                for j in range(n):
                    x = screen.x[None, :] + width * ((i + rng.random(screen.shape)) / n - 0.5)
                    y = screen.y[:, None] + height * ((j + rng.random(screen.shape)) / n - 0.5)
                    points = np.asarray(observer.target) + x[..., None] * right + y[..., None] * up
                    towards = observer.position - points
                    towards /= np.linalg.norm(towards, axis=-1, keepdims=True)
                    told = self._luminance(points.reshape(-1, 3), towards.reshape(-1, 3))
                    seen = np.asarray(told, dtype=np.float64).reshape(screen.shape)
                    total += seen
                    # Cells two by two; of an odd number the last with the one before, for itself alone.
                    if j % 2 or (j and j == n - 1):
                        variance += (seen - last) ** 2 * (1.0 if j % 2 else 0.5)
                    last = seen
            yield total / n**2, np.sqrt(variance) / n**2 if n > 1 else None


def lines_per_pixel(screen: Screen) -> int:
    """How many lines of sight a pixel has if nothing is said.

    Examples
    --------
    >>> [lines_per_pixel(Screen(1, 1, n, n)) for n in (64, 512)]
    [16, 4]
    """
    return max(LEAST, math.ceil(LINES / (screen.columns * screen.rows)))


def lamp_of(
    source: Source, samples: int | None = None, size: float | None = None, seed: int = 1, threads: int | None = None
) -> Lamp:
    """A source as a lamp.

    Parameters
    ----------
    source : LightField, RayStream, Scene, path or callable
        To rays a light field is fitted, since rays have no luminance. A function takes points [mm] and unit vectors in
        which the light travels, shape (n, 3) each, and tells luminance [cd/m²].
    samples : int, optional
        Lines of sight per pixel; if left out, as many as make 65 536 in each image, at least 4.
    size : number, optional
        Diameter of a ball about the origin that holds a function's lamp [mm].
    seed : int
        Of lines of sight, and of rays drawn anew.
    threads : int, optional
        All cores if None.

    Raises
    ------
    ArgumentError
        If it is no source, its extent is not known, or a number is impossible.

    Examples
    --------
    >>> import etendue as et
    >>> lamp_of(et.Scene(sources=[{"kind": "surface", "shape": {"kind": "disk", "radius": 3}, "flux": 10}])).flux_unit
    'lm'
    """
    require(samples, (int, type(None)), "samples", "a whole number of lines of sight per pixel, or None")
    if samples is not None and not 1 <= samples <= 1 << 16:
        raise ArgumentError(f"{samples} lines of sight per pixel; give 1 to 65536.")
    if isinstance(source, str | os.PathLike):
        source = open_source(source)
    if isinstance(source, Scene):
        return SceneLamp(source, None if samples is None else max(samples, 2), seed, threads)
    if isinstance(source, LightField):
        return FieldLamp(source, samples, seed, threads)
    if isinstance(source, RayStream):
        return FieldLamp(fit_or_recall(source, threads=threads), samples, seed, threads)
    if callable(source):
        return FunctionLamp(source, size, samples, seed)
    raise ArgumentError(
        f"{type(source).__name__} is no source: give a light field, rays, a scene, a path or a function."
    )
