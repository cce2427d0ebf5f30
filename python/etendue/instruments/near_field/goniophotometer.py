"""`NearFieldGoniophotometer`: a virtual camera and a virtual photometer on an arm that moves around a lamp."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from etendue.concurrency import in_order
from etendue.errors import ArgumentError
from etendue.instruments.near_field.camera import Camera
from etendue.instruments.near_field.far_field import FAR
from etendue.instruments.near_field.lamps import MARGIN, Lamp, Source, lamp_of
from etendue.instruments.near_field.merging import stretches
from etendue.instruments.near_field.positions import ArmPositions
from etendue.instruments.near_field.run import NearFieldRun
from etendue.instruments.near_field.setting import Setting, counts_dtype
from etendue.quantities.arguments import as_point, require_callable, require_number, require_numbers
from etendue.quantities.observer import Observer, Screen
from etendue.quantities.ray_stream import checked_seed, checked_threads
from etendue.quantities.spool import Spool
from etendue.units import MM2_PER_M2

Array = npt.NDArray[np.float64]
Progress = Callable[[int, int], None]
"""Called with the positions that are done, and how many there are."""

AROUND = 128
"""Pixels along each side of the image that shows the photometer what the camera's own does not."""

SEEN = np.dtype([("pixel", "<u4"), ("luminance", "<f4")])


@dataclasses.dataclass(frozen=True)
class NearFieldGoniophotometer:
    """A near-field goniophotometer of type C: section 1.3.1 of [Audenaert2014]_.

    Camera and photometer stand at the end of an arm that turns around the lamp. At each position the camera takes relative
    luminance images, and the photometer measures illuminance. The total flux is the integral of the illuminance over the
    sphere; it sets the scale of the images. Each pixel is then a ray of known direction and flux.

    Parameters
    ----------
    step : number or (number, number)
        Between positions in γ, and in C if it is another [°].
    distance : number, optional
        From the centre to camera and photometer [mm]; 15 times the size of the lamp if left out.
    camera_pixels : int
        Along each side of the image.
    exposures : int
        Images of each position, at times that rise by `exposure_ratio`; all positions have the same times.
    field_of_view : number, optional
        Side of the square that the image shows at the centre [mm]; just all of the lamp if left out.
    centre : (number, number, number), optional
        The point about which the arm turns [mm], in the coordinates of the lamp; its middle if left out.
    photometer_distance : number, optional
        If it is another [mm].
    photometer_error : number
        Standard deviation of each of its readings, as a share.
    bits, full_well, read_noise, blur, exposure_ratio, level, exposure_error, threshold
        Of the camera, see `Camera`.
    misalignment : (number, number, number)
        By how much the lamp stands beside where it is taken to be [mm].
    arm_error : number
        Standard deviation of γ and C of each position from their stated values [°].

    Raises
    ------
    ArgumentError
        If a number is impossible.

    Examples
    --------
    >>> import etendue as et
    >>> disk = {"kind": "surface", "shape": {"kind": "disk", "radius": 2}, "flux": 100}
    >>> run = et.NearFieldGoniophotometer(step=30, camera_pixels=32).measure(et.Scene(sources=[disk]))
    >>> round(run.total_flux), run.ray_set(1000).total_flux == run.total_flux
    (100, True)
    """

    step: float | tuple[float, float] = 5.0
    distance: float | None = None
    _: dataclasses.KW_ONLY
    camera_pixels: int = 512
    exposures: int = 1
    field_of_view: float | None = None
    centre: tuple[float, float, float] | None = None
    photometer_distance: float | None = None
    photometer_error: float = 0.0
    bits: int = 12
    full_well: float = 20_000.0
    read_noise: float = 10.0
    blur: float = 0.0
    exposure_ratio: float = 10.0
    level: float = 0.9
    exposure_error: float = 0.0
    threshold: float = 5.0
    misalignment: tuple[float, float, float] = (0.0, 0.0, 0.0)
    arm_error: float = 0.0

    def __repr__(self) -> str:
        """What differs from the defaults."""
        stated = [f for f in dataclasses.fields(self) if getattr(self, f.name) != f.default]
        return f"NearFieldGoniophotometer({', '.join(f'{f.name}={getattr(self, f.name)!r}' for f in stated)})"

    def __post_init__(self) -> None:
        stated = ("distance", "field_of_view", "photometer_distance")
        require_numbers(self, *stated, instead="a length in mm", none=True)
        require_numbers(self, "camera_pixels", "exposures", "bits", "full_well", "read_noise", "blur", "exposure_ratio")
        require_numbers(self, "level", "exposure_error", "threshold", "photometer_error", "arm_error")
        for name in stated:
            value = getattr(self, name)
            if value is not None and not 0.0 < value < math.inf:
                raise ArgumentError(f"{name} is {value} mm; give a length above 0.")
        for name in ("photometer_error", "arm_error"):
            value = getattr(self, name)
            if not 0.0 <= value <= (0.5 if name == "photometer_error" else 10.0):
                raise ArgumentError(f"{name} is {value}; give a standard deviation from 0 on, and a small one.")
        for name in ("centre", "misalignment"):
            value = getattr(self, name)
            if value is not None:
                as_point(value, f"NearFieldGoniophotometer: {name}", "three finite coordinates in mm")
        self.camera, self.positions  # noqa: B018 - they refuse what they cannot be

    @property
    def camera(self) -> Camera:
        """The image sensor."""
        return Camera(
            self.camera_pixels,
            self.bits,
            self.full_well,
            self.read_noise,
            self.blur,
            self.exposures,
            self.exposure_ratio,
            self.level,
            self.exposure_error,
            self.threshold,
        )

    @property
    def positions(self) -> ArmPositions:
        """Where the arm stops."""
        wanted = "a number of degrees, or (step of γ, step of C)"
        steps = self.step if isinstance(self.step, tuple) and len(self.step) == 2 else (self.step, self.step)
        for step in steps:
            require_number(step, "NearFieldGoniophotometer: step", wanted)
        gamma, c = steps
        return ArmPositions(float(gamma), float(c))

    def measure(
        self,
        lamp: Source,
        *,
        seed: int = 1,
        samples: int | None = None,
        size: float | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> NearFieldRun:
        """Measure a lamp from all positions.

        Parameters
        ----------
        lamp : LightField, RayStream, Scene, path or callable
            What is measured; rays are fitted first. A callable takes points [mm] and unit vectors in which the light
            travels, shape (n, 3) each, and tells luminance [cd/m²], shape (n,).
        seed : int
            Of noise, errors, and lines of sight through scenes.
        samples : int, optional
            Points of each pixel that are looked at; if left out, as many as make 65 536 in each image, at least 4.
        size : number, optional
            Diameter of a ball about the origin that holds the lamp [mm]: of a callable it is not known.
        threads : int, optional
            All cores if None. The result has the same bits for any number.
        progress : callable, optional
            Called with the positions that are done, and how many there are.

        Returns
        -------
        NearFieldRun

        Raises
        ------
        ArgumentError
            If the lamp reaches as far as the camera or the photometer, is dark from everywhere, or there is no such seed.
        FormatError, OSError, SceneError
            As the reading of a file.
        """
        require_callable(progress)
        seed, threads = checked_seed(seed), checked_threads(threads)
        source = lamp_of(lamp, samples, size, seed, threads)
        setting, around = self._setting(source)
        workers = threads or os.cpu_count() or 1
        stops, seen, light, light_error, brightest = self._look(source, setting, around, seed, progress)
        if not brightest > 0.0:
            raise ArgumentError(f"{source.name}: no light was seen from any position.")
        light_error, integral_error = source.errors_of_readings(setting.positions, light, light_error)
        if self.photometer_error:
            rng = np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, 1))))
            own = self.photometer_error * light
            light_error = np.hypot(light_error, own)
            integral_error = math.hypot(integral_error, float(np.linalg.norm(setting.positions.weight * own)))
            light = light * (1.0 + self.photometer_error * rng.standard_normal(light.size))
        start, counts = self._exposed(seen, stops, brightest, seed, workers)
        return NearFieldRun(
            setting,
            light,
            light_error,
            start,
            counts,
            source.flux_unit,
            source.provenance.then(f"near-field goniophotometer: {len(self.positions)} positions, seed {seed}"),
            source.notes,
            integral_error * setting.photometer_distance**2 / MM2_PER_M2,
        )

    def _setting(self, lamp: Lamp) -> tuple[Setting, float]:
        """What was open, closed; and to which side length the photometer sees light [mm]."""
        centre = lamp.centre() if self.centre is None else self.centre
        shown, whole = lamp.reach(np.asarray(centre) - np.asarray(self.misalignment))
        distance = self.distance
        if distance is None:
            distance = float(f"{2.0 * FAR * shown:.2g}")
        photometer = distance if self.photometer_distance is None else self.photometer_distance
        for name, value in (("camera", distance), ("photometer", photometer)):
            if value <= shown:
                raise ArgumentError(
                    f"the {name} stands {value:g} mm from the centre, and {lamp.name} reaches {shown:.4g} mm; move it away."
                )
        # A line that passes the centre at r is seen farther out in the plane of the image.
        view = self.field_of_view
        if view is None:
            view = float(f"{2.0 * MARGIN * shown / np.sqrt(1.0 - (shown / distance) ** 2):.3g}")
        far = min(whole, 0.999 * photometer)
        around = 2.0 * far / np.sqrt(1.0 - (far / photometer) ** 2)
        x, y, z = (float(v) for v in centre)
        return Setting(self.positions, self.camera, distance, photometer, view, (x, y, z), 2.0 * shown), around

    def _look(
        self, lamp: Lamp, setting: Setting, around: float, seed: int, progress: Progress | None
    ) -> tuple[npt.NDArray[np.intp], Spool, Array, Array, float]:
        """Luminance of the lit pixels of all positions, the illuminance at the photometer and its sampling error."""
        true, at_photometer = self._observers(setting, seed)
        screen, count = setting.screen, len(true)
        stops, seen = np.zeros(count + 1, dtype=np.intp), Spool(SEEN)
        light, variance, brightest = np.zeros(count), np.zeros(count), 0.0
        same = setting.distance == setting.photometer_distance
        share = setting.illuminance_of(screen, setting.distance)
        others = _outside(around, setting, inner=same)
        beyond = []
        if others is not None:
            beyond.append((lamp.images(at_photometer, others), _weight(others, setting, screen if same else None)))
        for k, (image, error) in enumerate(lamp.images(true, screen)):
            seen_here = [(image, error, share)] if same else []
            seen_here += [(*next(images), weight) for images, weight in beyond]
            for values, off, weight in seen_here:
                light[k] += float((values * weight).sum())
                variance[k] += 0.0 if off is None else float(((off * weight) ** 2).sum())
            thrown = self.camera.blurred(image)
            lit = np.flatnonzero(thrown > 0.0)
            found = np.zeros(lit.size, dtype=SEEN)
            found["pixel"], found["luminance"] = lit, thrown.ravel()[lit]
            brightest = max(brightest, float(found["luminance"].max(initial=0.0)))
            seen.append(found)
            stops[k + 1] = stops[k] + lit.size
            if progress is not None:
                progress(k + 1, count)
        return stops, seen, light, np.sqrt(variance), brightest

    def _observers(self, setting: Setting, seed: int) -> tuple[list[Observer], list[Observer]]:
        """Where camera and photometer are, with the errors of the arm and of the lamp's place."""
        stops = setting.positions
        rng = np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, 3))))
        off = self.arm_error * rng.standard_normal((2, len(stops)))
        gamma, c = stops.gamma + off[0], stops.c + off[1]
        # Past a pole it is the other side.
        c = np.where((gamma < 0.0) | (gamma > 180.0), c + 180.0, c)
        gamma = np.where(gamma > 180.0, 360.0 - gamma, np.abs(gamma))
        x, y, z = (float(a - b) for a, b in zip(setting.centre, self.misalignment, strict=True))
        stations = (setting.distance, setting.photometer_distance)
        camera, photometer = (
            [Observer(float(g), float(a), station, (x, y, z)) for g, a in zip(gamma, c, strict=True)]
            for station in stations
        )
        return camera, photometer

    def _exposed(
        self, seen: Spool, stops: npt.NDArray[np.intp], brightest: float, seed: int, workers: int
    ) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.void]]:
        """Counts of the pixels that are not dark in all exposures."""
        camera, luminance = self.camera, seen.array()
        times = camera.true_times(seed)
        per = camera.level * camera.highest / brightest
        counts, kept = Spool(counts_dtype(camera.exposures)), np.zeros(len(stops), dtype=np.intp)

        def exposed(numbered: tuple[int, slice]) -> tuple[npt.NDArray[np.void], npt.NDArray[np.intp]]:
            number, some = numbered
            rng = np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, 5, number))))
            read = camera.expose(luminance["luminance"][some].astype(np.float64), per, times, rng)
            bright = (read > camera.dark_level + camera.least_count).any(axis=1)
            record = np.zeros(int(bright.sum()), dtype=counts_dtype(camera.exposures))
            record["pixel"], record["counts"] = luminance["pixel"][some][bright], read[bright]
            summed = np.concatenate([[0], np.cumsum(bright)])
            return record, summed[np.clip(stops - some.start, 0, bright.size)]

        for record, summed in in_order(exposed, enumerate(stretches(len(luminance))), workers):
            counts.append(record)
            kept += summed
        return kept, counts.array()


def _outside(around: float, setting: Setting, *, inner: bool) -> Screen | None:
    """A screen for the light that the camera's image does not show the photometer; None if it shows all.

    Of the image it is a whole multiple, so that its pixels lie inside it or outside.
    """
    if not inner:
        side = max(around, MARGIN * setting.field_of_view)
        return Screen(side, side, AROUND, AROUND)
    if around <= setting.field_of_view * (1.0 + 1e-9):
        return None
    for doubling in range(1, 7):
        side = setting.field_of_view * 2.0**doubling
        if side >= around:
            break
    return Screen(side, side, AROUND, AROUND)


def _weight(screen: Screen, setting: Setting, within: Screen | None) -> Array:
    """Illuminance at the photometer by each pixel with 1 cd/m²; nothing by what another screen within shows."""
    weight = setting.illuminance_of(screen, setting.photometer_distance)
    if within is None:
        return weight
    inside_x, inside_y = np.abs(screen.x) < within.width / 2, np.abs(screen.y) < within.height / 2
    return np.where(inside_y[:, None] & inside_x[None, :], 0.0, weight)
