"""`NearFieldRun`: what a near-field goniophotometer recorded, and what is made of it."""

from __future__ import annotations

import dataclasses
import math
import os
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from etendue.description.values import is_number
from etendue.errors import ArgumentError
from etendue.formats.input import as_path
from etendue.instruments.near_field.far_field import (
    far_field_notes,
    integral_notes,
    linear_notes,
    step_notes,
    table_notes,
)
from etendue.instruments.near_field.merging import Merging, stretches
from etendue.instruments.near_field.pixel_rays import PixelRays, in_blocks
from etendue.instruments.near_field.setting import Setting, counts_dtype
from etendue.instruments.near_field.starting_points import closest_surface
from etendue.instruments.near_field.storage import read_run, write_run
from etendue.lightfield.carrier import Surface
from etendue.lightfield.light_field import LightField
from etendue.quantities.arguments import SURFACE, as_whole, described, require, require_callable, require_number
from etendue.quantities.intensity import Intensity
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.ray_stream import Progress, checked_seed
from etendue.quantities.spool import Spool
from etendue.units import MM2_PER_M2, FluxUnit

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.intp]

RECORD = np.dtype([("position", "<f4", (3,)), ("direction", "<f4", (3,)), ("flux", "<f4")])
"""A ray, as ray files hold it."""

MOST_RAYS = 10**11
"""That may be drawn from the pixels."""

PILOT = 1 << 14
"""Rays that show where they may start."""

UNSURE = 3e-3
"""Error of the ratio of two exposure times that is worth a note."""

TOLD = 1e-3
"""Share of the flux from which something is worth a note."""


@dataclasses.dataclass(frozen=True, eq=False)
class NearFieldRun:
    """Images and illuminances of all positions of a near-field measurement.

    Parameters
    ----------
    setting : Setting
    illuminance : array, shape (positions,)
        At the photometer [lx or W/m²].
    illuminance_error : array, shape (positions,)
        Standard error of each.
    start : array of int, shape (positions + 1,)
        First record of each position.
    records : structured array, shape (n,)
        ``pixel`` and ``counts`` of each pixel that is not dark.
    flux_unit : {"lm", "W"}
    provenance : Provenance
    source_notes : tuple of str
        What the lamp has to tell.
    flux_error : number, optional
        Standard error of `total_flux` [`flux_unit`]; None: that of independent readings.

    Examples
    --------
    >>> import etendue as et
    >>> disk = {"kind": "surface", "shape": {"kind": "disk", "radius": 2}, "flux": 100}
    >>> run = et.NearFieldGoniophotometer(step=30, camera_pixels=32).measure(et.Scene(sources=[disk]))
    >>> round(run.intensity().at(0, 0).item()), round(float(run.luminance_map(60, 0).values.max()) / 2.53e6, 1)
    (32, 1.0)
    """

    setting: Setting
    illuminance: Array
    illuminance_error: Array
    start: Integers
    records: npt.NDArray[np.void]
    flux_unit: FluxUnit
    provenance: Provenance
    source_notes: tuple[str, ...] = ()
    flux_error: float | None = None

    def __repr__(self) -> str:
        """Positions, lit pixels, flux."""
        return (
            f"<NearFieldRun of {len(self.setting.positions):,} positions, {len(self.records):,} lit pixels, "
            f"{self.total_flux:.4g} {self.flux_unit}>"
        )

    # --- the photometer ----------------------------------------------------------------------------------------------

    @property
    def total_flux(self) -> float:
        """Integral of the illuminance over the sphere [`flux_unit`]."""
        square = self.setting.photometer_distance**2 / MM2_PER_M2
        return float(self.setting.positions.weight @ self.illuminance) * square

    @property
    def total_flux_error(self) -> float:
        """Standard error of `total_flux` by that of the readings [`flux_unit`], and by what they err together.

        What the integral misses between positions is not in it; `notes` tell where a beam is too narrow for their steps, or
        the light changes too much between them.
        """
        if self.flux_error is not None:
            return self.flux_error
        square = self.setting.photometer_distance**2 / MM2_PER_M2
        return float(np.linalg.norm(self.setting.positions.weight * self.illuminance_error)) * square

    def intensity(self) -> Intensity:
        """The luminous intensity distribution by the photometer alone: illuminance times the square of its distance.

        Notes say so if it does not stand in the far field: nearer than 15 sizes of the lamp, or with a beam so narrow that
        the size of the lamp broadens it. A Gaussian beam of width w is lowered at its peak by 0.35 (β/w)², for a lamp, an
        even disk, that is seen under β.
        """
        stops = self.setting.positions
        square = self.setting.photometer_distance**2 / MM2_PER_M2
        values = stops.table(self.illuminance) * square
        told = (*far_field_notes(self.setting, values), *self._integral_notes)
        table = Intensity(
            stops.planes,
            stops.rings,
            values,
            stops.table(self.illuminance_error) * square,
            self.flux_unit,
            self.total_flux_error,
            provenance=self.provenance.then("intensity by the photometer"),
        )
        return table.replace(notes=(*told, *table_notes(table, self.total_flux), *self.source_notes))

    # --- the camera --------------------------------------------------------------------------------------------------

    @cached_property
    def merging(self) -> Merging:
        """How the exposures are put together."""
        parts = (self.records["counts"][some] for some in stretches(len(self.records)))
        return Merging.calibrated(self.setting.camera, parts)

    @cached_property
    def _merged(self) -> tuple[npt.NDArray[np.float32], int]:
        """Relative luminance of each record, and how many are saturated in all exposures."""
        values, saturated = np.zeros(len(self.records), dtype=np.float32), 0
        for some in stretches(len(self.records)):
            merged, full = self.merging.merged(self.records["counts"][some])
            values[some] = merged
            saturated += int(full.sum())
        return values, saturated

    @property
    def saturated(self) -> int:
        """Pixels, over all positions, that are saturated even in the shortest exposure."""
        return self._merged[1]

    @cached_property
    def _relative(self) -> Array:
        """Illuminance at the camera by its images, at each position, in relative units."""
        share = self.setting.illuminance_of(self.setting.screen, self.setting.distance).ravel()
        values, _ = self._merged
        return np.array([
            share[self.records["pixel"][a:b]] @ values[a:b].astype(np.float64)
            for a, b in zip(self.start[:-1], self.start[1:], strict=True)
        ])  # fmt: skip

    @cached_property
    def scale(self) -> float:
        """Luminance [cd/m² or W/(m² sr)] of one count in the shortest exposure: that which makes the flux of all images the
        photometer's."""  # noqa: D205, D209 - one sentence
        square = self.setting.distance**2 / MM2_PER_M2
        seen = float(self.setting.positions.weight @ self._relative) * square
        if not seen > 0.0:
            raise ArgumentError("the camera saw no light: raise its level, or take more exposures.")
        return self.total_flux / seen

    @property
    def disagreement(self) -> float:
        """Share of the flux which the images put into other directions than the photometer did, 0 to 1.

        Half the sum over positions of |E by the images - E by the photometer|, both scaled to the camera's distance. Light
        too faint for the camera, saturated pixels and a wrong scale show here, with no knowledge of the truth.
        """
        stops, square = self.setting.positions, self.setting.distance**2 / MM2_PER_M2
        photometer = self.illuminance * (self.setting.photometer_distance / self.setting.distance) ** 2
        off = np.abs(self.scale * self._relative - photometer)
        return 0.5 * float(stops.weight @ off) * square / self.total_flux

    @property
    def lit_pixels(self) -> int:
        """Pixels that are not dark, over all positions."""
        return int(np.count_nonzero(self._merged[0]))

    def sees_light(self, position: int) -> bool:
        """Whether the image of a position is not dark."""
        position = as_whole(position, "sees_light: position", 0, len(self.setting.positions) - 1)
        return bool(self._merged[0][self.start[position] : self.start[position + 1]].any())

    def luminance_map(self, gamma: float, c: float = 0.0) -> LuminanceMap:
        """The image of the position nearest to a direction.

        Parameters
        ----------
        gamma, c : number
            [°]

        Returns
        -------
        LuminanceMap
            With the noise of the camera as its standard error.
        """
        for name, angle in (("gamma", gamma), ("c", c)):
            require_number(angle, f"NearFieldRun.luminance_map: {name}", "an angle in °")
            if not math.isfinite(angle):
                raise ArgumentError(f"NearFieldRun.luminance_map: {name} is {angle:g}; give an angle in °.")
        stops, screen = self.setting.positions, self.setting.screen
        k = stops.nearest(gamma, c)
        some = slice(self.start[k], self.start[k + 1])
        relative = np.zeros(screen.columns * screen.rows)
        relative[self.records["pixel"][some]] = self._merged[0][some]
        relative = relative.reshape(screen.shape)
        return LuminanceMap(
            relative * self.scale,
            self.merging.standard_error(relative) * self.scale,
            np.full(screen.shape, -1),
            Observer(float(stops.gamma[k]), float(stops.c[k]), self.setting.distance, self.setting.centre),
            screen,
            self.flux_unit,
            self.provenance.then(f"image at γ = {stops.gamma[k]:g}°, C = {stops.c[k]:g}°"),
            self.notes,
        )

    def using(self, exposures: int) -> NearFieldRun:
        """The same measurement with the shortest exposures alone.

        Parameters
        ----------
        exposures : int
            How many.

        Raises
        ------
        ArgumentError
            If there are not as many.
        """
        camera = self.setting.camera
        exposures = as_whole(exposures, "NearFieldRun.using: exposures", 1, camera.exposures)
        if exposures == camera.exposures:
            return self
        records = np.zeros(len(self.records), dtype=counts_dtype(exposures))
        records["pixel"], records["counts"] = self.records["pixel"], self.records["counts"][:, :exposures]
        setting = dataclasses.replace(self.setting, camera=dataclasses.replace(camera, exposures=exposures))
        return dataclasses.replace(self, setting=setting, records=records)

    def exposures_needed(self, error: float = 1e-3) -> int | None:
        """The least number of exposures with which the images put no more than that share of the flux elsewhere.

        Parameters
        ----------
        error : number
            Largest `disagreement`.

        Returns
        -------
        int or None
            None if those of this measurement are not enough, or something else is wrong.
        """
        require_number(error, "exposures_needed: error", "a share of the flux")
        for n in range(1, self.setting.camera.exposures + 1):
            if self.using(n).disagreement <= error:
                return n
        return None

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know."""
        told = list(self.source_notes)
        if self.saturated:
            told.append(
                f"{self.saturated:,} pixels are saturated in the shortest exposure: their light is missing; lower its level"
            )
        if self.disagreement > TOLD:
            told.append(
                f"the images put {self.disagreement:.2%} of the flux into other directions than the photometer: light too "
                "faint for the camera, or beyond its image, or an arm or lamp out of place; more exposures show whether it "
                "is the first"
            )
        unsure = np.flatnonzero(self.merging.errors > UNSURE)
        if unsure.size:
            which = ", ".join(f"{i + 1} to {self.merging.errors[i]:.1%}" for i in unsure)
            told.append(
                f"how much longer an exposure is than the one before is known of exposure {which}: few pixels show in both"
            )
        return (*told, *self._integral_notes)

    @cached_property
    def _integral_notes(self) -> tuple[str, ...]:
        """What may be wrong with the total flux."""
        narrow = tuple(step_notes(self.setting, self.setting.positions.table(self.illuminance)))
        return narrow or tuple(integral_notes(self.setting, self.illuminance, self.illuminance_error))

    # --- rays --------------------------------------------------------------------------------------------------------

    @cached_property
    def _pixel_rays(self) -> PixelRays:
        """The lit pixels as rays."""
        setting, (values, _) = self.setting, self._merged
        lit = np.flatnonzero(values)
        start = np.searchsorted(lit, self.start).astype(np.intp)
        pixel = self.records["pixel"][lit]
        share = setting.illuminance_of(setting.screen, setting.distance).ravel()
        # Directions fill hats. With the weights that integrate splines, light would be off about the axis and the horizon.
        weight = setting.positions.hat * self.scale * setting.distance**2 / MM2_PER_M2
        flux = np.zeros(lit.size, dtype=np.float32)
        for some in stretches(lit.size):
            stop = np.searchsorted(start, np.arange(some.start, some.stop), side="right") - 1
            flux[some] = weight[stop] * share[pixel[some]] * values[lit[some]]
        return PixelRays(setting.positions, setting.screen, setting.centre, setting.distance, start, pixel, flux)

    def closest_surface(self, seed: int = 1) -> Surface:
        """The surface of least étendue that nearly all pixels look at: where rays start unless stated otherwise."""
        return closest_surface(self._pilot(checked_seed(seed)), seed)

    def _pilot(self, seed: int) -> RaySet:
        """Some rays along the lines of pixels, where these pass the centre at their closest."""
        rays = self._pixel_rays
        summed = np.cumsum(rays.flux, dtype=np.float64)
        rng = np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, 6))))
        points, along, _ = rays.rays(rays.chosen(summed, 0, PILOT, 0.5), None, rng, between=False)
        away = np.einsum("ij,ij->i", points - np.asarray(self.setting.centre), along)
        return RaySet(points - away[:, None] * along, along, np.full(PILOT, 1.0 / PILOT))

    def ray_set(
        self,
        rays: int | None = None,
        *,
        surface: Surface | Literal["closest"] = "closest",
        seed: int = 1,
        progress: Progress | None = None,
    ) -> RaySet:
        """A ray file: rays from the pixels, each with the flux that the photometer's scale gives it.

        Directions fill the space between positions: the point of the surface that a pixel sees sends the same light, by the
        weight of its position there. The flux of all rays is `total_flux`.

        Parameters
        ----------
        rays : int, optional
            Of equal flux, spread evenly over the light; None: one for each lit pixel, with the flux of that.
        surface : Surface or "closest"
            Where they start. The closer it is to what emits, the less is blurred between positions. Open dimensions are as
            small as the pixels allow.
        seed : int
            Of places within pixels, and of directions between positions.
        progress : callable, optional
            Called with the rays that are done.

        Returns
        -------
        RaySet
            In the lamp's coordinates; its notes say if rays do not cross the surface: these start in the plane through the
            centre.

        Raises
        ------
        ArgumentError
            If the number of rays is impossible, or there is no such seed.
        """
        if rays is not None and not (is_number(rays) and 1 <= rays <= MOST_RAYS and int(rays) == rays):
            raise ArgumentError(
                f"NearFieldRun.ray_set: rays is {described(rays)}; give a whole number from 1 to {MOST_RAYS:,}, or None."
            )
        require_callable(progress)
        pixels = self._pixel_rays
        at = self._surface(surface, checked_seed(seed))
        n = pixels.flux.size if rays is None else int(rays)
        summed = None if rays is None else np.cumsum(pixels.flux, dtype=np.float64)
        offset = float(np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, 7)))).random())
        spool, astray = Spool(RECORD), 0.0

        def make(first: int, count: int, rng: np.random.Generator) -> None:
            nonlocal astray
            lit = np.arange(first, first + count) if summed is None else pixels.chosen(summed, first, count, offset)
            points, along, missed = pixels.rays(lit, at, rng, between=True)
            record = np.zeros(count, dtype=RECORD)
            record["position"], record["direction"] = points, along
            record["flux"] = pixels.flux[lit] if summed is None else 1.0
            astray += float(record["flux"][missed].sum())
            spool.append(record)

        in_blocks(n, seed, make, progress)
        records = spool.array()
        share = astray / float(records["flux"].sum(dtype=np.float64))
        told = linear_notes(self.setting, self.setting.positions.table(self.illuminance))
        notes = [*self.notes, *told, f"rays start on {at.told}"]
        if share > 0.0:
            notes.append(f"{share:.3%} of the flux does not cross it: these rays start in the plane through the centre")
        drawn = "one ray for each lit pixel" if rays is None else f"{n} rays from the pixels, seed {seed}"
        meaning = RaySetMeaning(
            flux_unit=self.flux_unit,
            declared_flux=self.total_flux,
            relative_by_format=True,
            provenance=self.provenance.then(drawn),
            notes=tuple(notes),
        )
        return RaySet.from_records(records, meaning)

    def _surface(self, surface: Surface | Literal["closest"], seed: int) -> Surface:
        if isinstance(surface, str) and surface == "closest":
            return self.closest_surface(seed)
        if not isinstance(surface, Surface):
            raise ArgumentError(f"{surface!r} is no surface; give et.Sphere(…), et.Box(…), … or 'closest'.")
        return surface.sized_for(self._pilot(seed)) if surface.open_dimensions else surface

    def light_field(
        self, surface: Surface | Literal["auto"] = "auto", *, seed: int = 1, progress: Progress | None = None
    ) -> LightField:
        """The light field straight from the images: every lit pixel counts, by its flux, and none twice.

        Parameters
        ----------
        surface : Surface or "auto"
            See `LightField.fit`.
        seed : int
            Of places within pixels, of directions between positions, and of the fit.
        progress : callable, optional
            Called with the rays that are done.
        """
        require_callable(progress)
        require(surface, (str, Surface), "NearFieldRun.light_field: surface", f"'auto', or {SURFACE}")
        return LightField.fit(self.ray_set(None, seed=seed), surface, seed=seed, progress=progress)

    # --- files -------------------------------------------------------------------------------------------------------

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write all that was recorded to an HDF5 file; docs/formats/near-field-runs.md describes it."""
        parts = (self.setting, self.illuminance, self.illuminance_error, self.start, self.records)
        facts = (self.flux_unit, self.provenance, self.source_notes, self.flux_error)
        return write_run(as_path(path), *parts, *facts)

    @staticmethod
    def load(path: str | os.PathLike[str]) -> NearFieldRun:
        """Read what `save` wrote.

        Raises
        ------
        FormatError
            If it is no such file, or damaged.
        OSError
            If it cannot be opened.
        """
        return NearFieldRun(*read_run(as_path(path)))
