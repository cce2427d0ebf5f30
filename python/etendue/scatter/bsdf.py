"""`Bsdf`: what a surface does to light, whether it is a model or a table.

**Frame.** Directions are unit vectors in the frame of the surface, +z being the normal of its front. They point *away*
from the surface: `incident` to where light comes from, `scattered` to where it goes. Light meets the front if the third
component of `incident` is positive.
"""

from __future__ import annotations

import abc
import functools
import math
from typing import Any, ClassVar, Literal, get_args

import numpy as np
import numpy.typing as npt

from etendue import _core
from etendue.description.files import Files
from etendue.description.values import SHORTEST_WAVELENGTH
from etendue.errors import ArgumentError
from etendue.quantities.arguments import as_numbers, as_whole, require_known, require_number
from etendue.quantities.bsdf_directions import direction
from etendue.quantities.vectors import lengths
from etendue.scatter.building import built
from etendue.scatter.scans.scans import Scans

Array = npt.NDArray[np.float64]
Side = Literal["front", "back"]

UNIT = 1e-6
"""By which the length of a direction may differ from 1."""

WAVELENGTH = 555.0
"""[nm], where nothing else is said."""


def unit_vectors(name: str, values: npt.ArrayLike) -> Array:
    """Directions of shape (…, 3), made unit exactly.

    Raises
    ------
    ArgumentError
        If they are not unit vectors.

    Examples
    --------
    >>> unit_vectors("incident", [0, 0, 1]).tolist()
    [0.0, 0.0, 1.0]
    """
    given = as_numbers(values, name, "unit vectors of shape (…, 3)")
    if given.ndim < 1 or given.shape[-1] != 3:
        raise ArgumentError(f"{name} has shape {given.shape}; unit vectors have shape (…, 3)")
    length = lengths(given)[..., None]
    if not (np.abs(length - 1.0) <= UNIT).all():
        raise ArgumentError(f"{name} holds vectors that are not of length 1")
    return np.asarray(given / length)


def _known(side: Side) -> Side:
    require_known(side, get_args(Side), "side")
    return side


class Bsdf(abc.ABC):
    """Bidirectional scattering distribution function of a surface, with the light that it mirrors and refracts beside it.

    Models (`etendue.bsdf`) and tables (`read_bsdf`, `Bsdf.from_scans`) are asked alike. Both media are air unless
    `media` states their refractive indices, in front and behind.

    Examples
    --------
    >>> import etendue as et
    >>> paint = et.bsdf.DiffuseSpecular(total_reflectance=0.84, specular_reflectance=0.04)
    >>> paint.reflectance([0, 45]).tolist()
    [0.84, 0.84]
    >>> float(paint.evaluate([0, 0, 1], [0.6, 0, 0.8]).round(6)) == round(0.8 / np.pi, 6)
    True
    """

    table: ClassVar[type[Bsdf]]
    """The class of tables, which is made of this one: `etendue.scatter.table` sets it."""

    @classmethod
    def from_scans(cls, scans: Scans, method: str = "automatic") -> Bsdf:
        """A table of what a goniometer measured.

        Parameters
        ----------
        scans : Scans
            Of all incidences, as `read_scans` reads them. Values below 0, as noise about a dark level has them, count in the
            share of the light, and a note tells how many they are and what they do to it; f of the table is nowhere below 0.
        method : {"specular-centred", "direction-cosines", "natural-neighbours", "radial-basis", "shepard", "smooth"}
            The way from the measured directions to a grid; or "automatic": the first of these for scans through the
            specular direction, another where there are none, and a note among the complaints of the table says so.
            "radial-basis" takes logarithms, and no values below 0.

        Returns
        -------
        BsdfTable

        Raises
        ------
        ArgumentError
            If the values do not suit the method, or a slice scatters more than 101 % of the light.
        UnknownNameError
            If there is no such method.
        MissingLibraryError
            If the method needs SciPy, and it is not installed.

        Examples
        --------
        >>> import etendue as et
        >>> from etendue.quantities.bsdf_directions import direction
        >>> incident = direction(30.0, 180.0)
        >>> to = np.concatenate([direction(np.arange(0.0, 85.0, 5.0), a) for a in (0.0, 90.0, 180.0)])
        >>> flat = et.Scans(np.tile(incident, (len(to), 1)), to, np.full(len(to), 0.25), reflectance=0.8)
        >>> round(float(et.Bsdf.from_scans(flat, method="smooth").reflectance(30)), 3)
        0.8
        """
        return cls.table.from_scans(scans, method)

    @abc.abstractmethod
    def record(self, files: Files) -> dict[str, Any]:
        """The BSDF as the core takes it; files that it names are looked for in the folder of `files`."""

    @functools.cached_property
    def _compiled(self) -> _core.Bsdf:
        return built(self.record(Files()))

    def evaluate(
        self,
        incident: npt.ArrayLike,
        scattered: npt.ArrayLike,
        *,
        wavelength: float = WAVELENGTH,
        media: tuple[float, float] = (1.0, 1.0),
    ) -> Array:
        """Return f [1/sr], the cosine not included; light that is mirrored or refracted has no f.

        Parameters
        ----------
        incident, scattered : array_like, shapes (…, 3) that broadcast
            Unit vectors away from the surface.
        wavelength : float
            In nm.
        media : (float, float)
            Refractive index in front and behind.

        Returns
        -------
        array, shape (…)

        Raises
        ------
        ArgumentError
            If a vector is not of length 1, or the wavelength or an index is not finite and above 0.
        """
        shape, pairs = _pairs(incident, scattered)
        return self._compiled.evaluate(*pairs, _surroundings(wavelength, media)).reshape(shape)

    def pdf(
        self,
        incident: npt.ArrayLike,
        scattered: npt.ArrayLike,
        *,
        wavelength: float = WAVELENGTH,
        media: tuple[float, float] = (1.0, 1.0),
    ) -> Array:
        """Density [1/sr] of scattered directions: f |cos θₛ|, whose integral is the share that is scattered.

        Parameters, result and errors are those of `evaluate`.
        """
        shape, pairs = _pairs(incident, scattered)
        return self._compiled.pdf(*pairs, _surroundings(wavelength, media)).reshape(shape)

    def sample(
        self,
        incident: npt.ArrayLike,
        n: int,
        *,
        seed: int = 0,
        wavelength: float = WAVELENGTH,
        media: tuple[float, float] = (1.0, 1.0),
    ) -> Array:
        """What becomes of `n` rays from a direction, by the shares of their flux.

        Parameters
        ----------
        incident : array_like, shape (3,) or (n, 3)
            Unit vector to where the rays come from, or one for each ray.
        n : int
            How many.
        seed : int
            The same seed gives the same rays.
        wavelength, media
            As in `evaluate`.

        Returns
        -------
        array, shape (n, 3)
            Where they go, mirrored and refracted ones included; NaN for those that are absorbed. A ray that goes on keeps
            its flux.

        Raises
        ------
        ArgumentError
            If `incident` is neither one unit vector nor one for each ray, `n` or `seed` is no whole number from 0 to
            2⁶⁴ − 1, or the wavelength or an index is not finite and above 0.
        """
        direction = unit_vectors("incident", incident)
        n, seed = as_whole(n, "n"), as_whole(seed, "seed")
        surroundings = _surroundings(wavelength, media)
        if direction.shape == (n, 3):
            return self._compiled.sample_each(direction, seed, surroundings)
        if direction.shape != (3,):
            raise ArgumentError(f"{n} rays come from one direction, or from {n}; incident has shape {direction.shape}")
        return self._compiled.sample(tuple(direction.tolist()), n, seed, surroundings)

    def reflectance(
        self,
        theta: npt.ArrayLike,
        phi: npt.ArrayLike = 0.0,
        side: Side = "front",
        *,
        wavelength: float = WAVELENGTH,
        media: tuple[float, float] = (1.0, 1.0),
    ) -> Array:
        """Directional-hemispherical reflectance: the share of light from a direction that is mirrored or scattered back.

        Parameters
        ----------
        theta, phi : array_like
            Angle of incidence from the normal of the side, and its azimuth [°].
        side : {"front", "back"}
            The side that the light meets.
        wavelength, media
            As in `evaluate`.

        Returns
        -------
        array
            Of the shape of `theta` and `phi` together.

        Raises
        ------
        ArgumentError
            If an angle of incidence is not from 0 to 90°, an azimuth is not finite, or the wavelength or an index is not
            finite and above 0.
        UnknownNameError
            If there is no such side.
        """
        mirrored, _, back, _ = self._shares(theta, phi, side, _surroundings(wavelength, media))
        return mirrored + back

    def transmittance(
        self,
        theta: npt.ArrayLike,
        phi: npt.ArrayLike = 0.0,
        side: Side = "front",
        *,
        wavelength: float = WAVELENGTH,
        media: tuple[float, float] = (1.0, 1.0),
    ) -> Array:
        """Directional-hemispherical transmittance: the share that passes to the other side, straight on or scattered.

        Parameters, result and errors are those of `reflectance`.
        """
        _, refracted, _, through = self._shares(theta, phi, side, _surroundings(wavelength, media))
        return refracted + through

    def regular_reflectance(
        self,
        theta: npt.ArrayLike,
        phi: npt.ArrayLike = 0.0,
        side: Side = "front",
        *,
        wavelength: float = WAVELENGTH,
        media: tuple[float, float] = (1.0, 1.0),
    ) -> Array:
        """The share that is mirrored in a single direction, which f does not hold.

        Parameters, result and errors are those of `reflectance`.
        """
        return self._shares(theta, phi, side, _surroundings(wavelength, media))[0]

    def regular_transmittance(
        self,
        theta: npt.ArrayLike,
        phi: npt.ArrayLike = 0.0,
        side: Side = "front",
        *,
        wavelength: float = WAVELENGTH,
        media: tuple[float, float] = (1.0, 1.0),
    ) -> Array:
        """The share that goes straight on or is refracted in a single direction, which f does not hold.

        Parameters, result and errors are those of `reflectance`.
        """
        return self._shares(theta, phi, side, _surroundings(wavelength, media))[1]

    def _shares(
        self, theta: npt.ArrayLike, phi: npt.ArrayLike, side: Side, media: tuple[float, float, float]
    ) -> tuple[Array, Array, Array, Array]:
        side = _known(side)
        angles, azimuths = as_numbers(theta, "theta", "angles in °"), as_numbers(phi, "phi", "azimuths in °")
        within = (angles >= 0.0) & (angles <= 90.0)
        if not within.all():
            raise ArgumentError(f"theta is {angles[~within][0]:g}°; give angles of incidence from 0 to 90°.")
        if not np.isfinite(azimuths).all():
            raise ArgumentError(f"phi is {phi!r}; give finite azimuths [°].")
        incident = direction(angles, azimuths, behind=side == "back")
        found = self._compiled.shares(incident.reshape(-1, 3), media)
        a, b, c, d = (column.reshape(incident.shape[:-1]) for column in found.T)
        return a, b, c, d

    def known_to(self, *, side: Side = "front", transmitted: bool = False) -> float:
        """The last angle of incidence at which scattered light is known [°]; beyond it a table goes on by a rule.

        Parameters
        ----------
        side : {"front", "back"}
            The side that the light meets.
        transmitted : bool
            Of transmitted instead of reflected light.

        Returns
        -------
        float
            90 for models, and where nothing is tabled.

        Raises
        ------
        UnknownNameError
            If there is no such side.

        Examples
        --------
        >>> from etendue.scatter.models import Lambertian
        >>> Lambertian(reflectance=0.5).known_to()
        90.0
        """
        return self._last(_known(side), transmitted)

    def _last(self, side: Side, transmitted: bool) -> float:  # noqa: ARG002 - a model is known at all angles
        return 90.0

    def irreciprocity(self) -> float:
        """By how much f there and back differ on average, relative to their mean: 0 where light goes back as it came.

        Over pairs of directions in front of the surface (of transmitted light: one behind), between equal media.
        """
        angles = np.array([5.0, 20.0, 35.0, 50.0, 65.0])
        one = direction(angles, 0.0)[:, None, None, :]
        there = there_and_back = 0.0
        for transmitted, is_there in ((False, self.reflects), (True, self.transmits)):
            if not is_there:
                continue
            other = direction(angles[:, None], np.arange(0.0, 360.0, 30.0), behind=transmitted)[None]
            pair = [self.evaluate(one, other), self.evaluate(other, one)]
            there += float(np.abs(pair[0] - pair[1]).sum())
            there_and_back += 0.5 * float((pair[0] + pair[1]).sum())
        return there / there_and_back if there_and_back > 0.0 else 0.0

    @property
    def ways(self) -> tuple[bool, bool, bool, bool]:
        """Whether light is mirrored, goes on in a single direction, is scattered back, is scattered to the other side."""
        a, b, c, d = self._compiled.facts()[0]
        return a, b, c, d

    @property
    def reflects(self) -> bool:
        """Whether light is scattered back."""
        return self.ways[2]

    @property
    def transmits(self) -> bool:
        """Whether light is scattered to the other side."""
        return self.ways[3]


def _surroundings(wavelength: float, media: tuple[float, float]) -> tuple[float, float, float]:
    """As the core takes them."""
    asked = f"a finite number of nm, {SHORTEST_WAVELENGTH:g} at least"
    require_number(wavelength, "wavelength", asked)
    if not (math.isfinite(wavelength) and wavelength >= SHORTEST_WAVELENGTH):
        raise ArgumentError(f"wavelength is {wavelength!r}; give {asked}.")
    wanted = "two refractive indices, finite and above 0: in front and behind"
    indices = as_numbers(media, "media", wanted)
    if indices.shape != (2,) or not (np.isfinite(indices) & (indices > 0.0)).all():
        raise ArgumentError(f"media is {media!r}; give {wanted}.")
    front, behind = indices.tolist()
    return float(wavelength), front, behind


def _pairs(incident: npt.ArrayLike, scattered: npt.ArrayLike) -> tuple[tuple[int, ...], tuple[Array, Array]]:
    both = np.broadcast_arrays(unit_vectors("incident", incident), unit_vectors("scattered", scattered))
    return both[0].shape[:-1], (both[0].reshape(-1, 3), both[1].reshape(-1, 3))
