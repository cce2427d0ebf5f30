"""`ScatterGoniometer`: a virtual instrument that measures a BSDF, by tracing its rays and by quadrature."""

from __future__ import annotations

import dataclasses
from typing import get_args

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.instruments.beam_and_aperture import Aperture, Beam, Profile, Shape
from etendue.instruments.bench import Bench
from etendue.instruments.detector_head import DetectorHead
from etendue.instruments.directional_scan import DirectionalScan
from etendue.instruments.goniometer_measurement import Measurement, Method, bare_scan
from etendue.instruments.goniometer_scan import GoniometerScan, Way
from etendue.instruments.photon_counter import PhotonCounter
from etendue.instruments.positions import Plane, even_angles, hemisphere, hemisphere_around, window
from etendue.instruments.turned_sample import TurnedSample
from etendue.quantities.arguments import BSDF, as_numbers, require, require_known, require_number, require_numbers
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.scatter.bsdf import Bsdf

Array = npt.NDArray[np.float64]

STEP, BARE_STEP = 0.1, 0.05
"""Between positions with a sample and without one, if nothing is said [°]."""

SPAN = 9.0
"""To which angles on both sides a scan goes if nothing is said [°]: 181 positions in steps of 0.1°."""


@dataclasses.dataclass(frozen=True)
class ScatterGoniometer:
    """A goniometer for scattered light: a beam on a sample, and an aperture on an arm about the middle of the spot.

    Defaults are the instrument of section 5.4.1 of the thesis. Its solid angle of 6.25·10⁻⁴ sr is that of an aperture of
    25.0 mm; section 1.3.2 states 25.4 mm, which has 6.45·10⁻⁴ sr.

    Parameters
    ----------
    beam_diameter : number
        Of the beam, across it [mm].
    aperture_diameter : number
        Of the aperture, or side of a square one [mm].
    distance : number
        From the middle of the spot to the aperture [mm].
    aperture : {"disk", "square", "ring"}
        Shape of the aperture.
    inner_diameter : number
        Of a ring [mm].
    profile : {"uniform", "gaussian"} or numbers
        Irradiance over the radius of the beam: even; falling to 1/e² at the edge; or values from the middle to the edge.
    divergence : number
        Angle of the outermost rays with the axis [°]; negative: convergent.
    source_angle : number
        Diameter of the source of light seen from the sample [°]: each point of the beam holds an even cone.
    wavelength : number
        In nm.
    photons : number, optional
        That the whole beam would be counted as at each position; None: there is no photon noise.
    dark : number
        Mean number of counts without light at each position, subtracted afterwards: the floor of the detector.
    drift : number
        By which share the beam has changed at the last position.
    head_diameter : number
        Of the head of the detector [mm], which shadows the sample where it gets into the beam: these positions are left
        out, and NaN over a hemisphere.

    Raises
    ------
    ArgumentError
        If a length or number is impossible.
    UnknownNameError
        If there is no such shape or profile.

    Examples
    --------
    >>> import etendue as et
    >>> goniometer = et.ScatterGoniometer(beam_diameter=14, aperture_diameter=25, distance=886)
    >>> round(goniometer.solid_angle * 1e4, 3), round(goniometer.instrument_function().fwhm, 2)
    (6.253, 1.53)
    >>> diffuser = et.bsdf.CosinePower(peak=2897, exponent=18204, way="transmitted")
    >>> scan = goniometer.measure(diffuser, step=0.5, rays=10_000)
    >>> round(scan.fwhm, 1)
    1.6
    """

    beam_diameter: float = 14.0
    aperture_diameter: float = 25.0
    distance: float = 886.0
    _: dataclasses.KW_ONLY
    aperture: Shape = "disk"
    inner_diameter: float = 0.0
    profile: Profile = "uniform"
    divergence: float = 0.0
    source_angle: float = 0.0
    wavelength: float = 550.0
    photons: float | None = None
    dark: float = 0.0
    drift: float = 0.0
    head_diameter: float = 0.0

    def __post_init__(self) -> None:
        require_numbers(self, "beam_diameter", "aperture_diameter", "distance", "inner_diameter", "head_diameter")
        require_numbers(self, "divergence", "source_angle", "wavelength", "dark", "drift")
        require_numbers(self, "photons", none=True)
        for name in ("beam_diameter", "aperture_diameter", "distance", "wavelength"):
            if not 0.0 < getattr(self, name) < np.inf:
                unit = "nm" if name == "wavelength" else "mm"
                stated = f"{name.replace('_', ' ')} of {getattr(self, name):g} {unit}"
                raise ArgumentError(f"a {stated}; give one above 0 {unit}")
        if not abs(self.divergence) < 45.0 or not 0.0 <= self.source_angle < 90.0:
            raise ArgumentError(
                f"a divergence of {self.divergence:g}° and a source_angle of {self.source_angle:g}°; give a divergence "
                "below 45°, and a source that is seen under less than 90°"
            )
        # The parts check the rest when they are made.
        _ = self._counter, self._head
        object.__setattr__(self, "profile", self.bench.beam.profile)

    @property
    def bench(self) -> Bench:
        """Beam, aperture and distance."""
        beam = Beam(self.beam_diameter, self.profile, self.divergence, self.source_angle)
        return Bench(beam, Aperture(self.aperture, self.aperture_diameter, self.inner_diameter), self.distance)

    @property
    def _head(self) -> DetectorHead:
        """The head of the detector."""
        return DetectorHead(self.head_diameter, self.beam_diameter, self.distance)

    @property
    def _counter(self) -> PhotonCounter:
        """What makes noise of the flux."""
        return PhotonCounter(self.photons, self.dark, self.drift)

    @property
    def solid_angle(self) -> float:
        """Ω of the aperture, area over square of the distance [sr]."""
        return self.bench.solid_angle

    def instrument_function(
        self, step: float = BARE_STEP, span: float | None = None, *, rays: int | None = None, seed: int = 1
    ) -> GoniometerScan:
        """The bare beam, scanned: what the instrument shows of an infinitely sharp sample (S of section 5.3).

        Parameters
        ----------
        step : number
            Between positions [°].
        span : number, optional
            To which angle on both sides [°]; just beyond the last light if left out.
        rays : int, optional
            Traced instead of computed from the overlap of beam and aperture.
        seed : int
            The same seed gives the same rays, and the same noise.

        Returns
        -------
        GoniometerScan
            Flux as a share of that of the beam.

        Raises
        ------
        ArgumentError
            If step, span or rays are impossible.
        """
        if span is None:
            # Two positions more, where there is no light any more.
            require_number(step, "step", "an angle in °")
            span = (np.ceil(self.bench.reach / step) + 2.0) * step if step > 0.0 else 1.0
        require_number(span, "span", "an angle in °, or None")
        angle = even_angles(0.0, step, float(span))
        return bare_scan(self.bench, self._counter, angle, wavelength=self.wavelength, rays=rays, seed=seed)

    def measure(
        self,
        bsdf: Bsdf,
        theta: float = 0.0,
        step: float = STEP,
        rays: int = 10**6,
        seed: int = 1,
        *,
        span: float = SPAN,
        plane: Plane = "in-plane",
        way: Way | None = None,
        method: Method = "trace",
        fresh: bool = False,
    ) -> GoniometerScan:
        """Measure a sample: the detector passes in one plane through the regular direction.

        Parameters
        ----------
        bsdf : Bsdf
            Of the sample; light meets its front from azimuth 180°.
        theta : number
            Angle of incidence [°].
        step, span : number
            Between positions, and from the regular direction to the last of them on both sides [°].
        rays : int
            At each position.
        seed : int
            The same seed gives the same rays, and the same noise.
        plane : {"in-plane", "cross-plane"}
            In which the detector moves.
        way : {"transmitted", "reflected"}, optional
            The light that is measured; need not be said of a sample that does only one.
        method : {"trace", "quadrature"}
            Rays drawn and counted; or integrals over beam and aperture, whose standard error is the difference from coarser
            ones.
        fresh : bool
            Draw rays of its own for each position, as an instrument does, so that errors are independent. Otherwise all
            positions count the same rays, which is as right at each of them and a tenth of the work, but neighbours err
            together.

        Returns
        -------
        GoniometerScan
            Flux as a share of that of the beam.

        Raises
        ------
        ArgumentError
            If a number is impossible, or `way` is not said of a sample that transmits and reflects.
        UnknownNameError
            If there is no such plane, way or method.
        """
        require_known(plane, get_args(Plane), "plane")
        way = _way(bsdf, way)
        return self._measurement(bsdf, theta, rays, seed, method, fresh=fresh).scan(plane, step, span, way)

    def flux_at(
        self,
        bsdf: Bsdf,
        directions: npt.ArrayLike,
        theta: float = 0.0,
        rays: int = 10**6,
        seed: int = 1,
        *,
        method: Method = "trace",
    ) -> tuple[Array, Array]:
        """Flux in the aperture wherever it stands, before any detector makes noise of it: what `Detector.read` reads.

        Parameters
        ----------
        bsdf, theta, rays, seed, method
            As those of `measure`; all directions count the same rays.
        directions : array, shape (n, 3)
            Unit vectors from the spot to the aperture, in front of the sample or behind it; light comes from azimuth 180°.

        Returns
        -------
        array, array, shape (n,)
            Share of the flux of the beam, and its standard error.

        Examples
        --------
        >>> import etendue as et
        >>> paint = et.bsdf.Lambertian(reflectance=0.5)
        >>> goniometer = et.ScatterGoniometer()
        >>> flux, _ = goniometer.flux_at(paint, [[0, 0, 1], [0.8, 0, 0.6]], method="quadrature")
        >>> (flux / goniometer.solid_angle).round(4).tolist()  # 0.5 cosθ / π
        [0.1591, 0.0955]
        """
        measurement = self._measurement(bsdf, theta, rays, seed, method)
        arms = _rows(directions)
        if not (np.abs(np.einsum("ij,ij->i", arms, arms) - 1.0) < 1e-6).all():
            raise ArgumentError("directions are unit vectors, shape (n, 3)")
        return measurement.flux_on_both_sides(arms)

    def measure_hemisphere(
        self,
        bsdf: Bsdf,
        theta: float = 0.0,
        step: float = 5.0,
        rays: int = 10**6,
        seed: int = 1,
        *,
        way: Way | None = None,
        method: Method = "trace",
    ) -> BsdfSlice:
        """Measure a sample over a hemisphere, in even steps of the angle from the normal and of the azimuth.

        Parameters are those of `measure`. The last position is half a step, at most 5°, above the plane of the sample.

        Returns
        -------
        BsdfSlice
            F [1/sr] by eq. 5.1 on a grid of azimuths and angles from the normal, with its standard error; NaN where the head
            of the detector stands in the beam.
        """
        way = _way(bsdf, way)
        grid = hemisphere(step)
        return self._measurement(bsdf, theta, rays, seed, method).slice_on(grid, way)

    def measure_directions(
        self,
        bsdf: Bsdf,
        directions: npt.ArrayLike,
        theta: float = 0.0,
        rays: int = 10**6,
        seed: int = 1,
        *,
        turn: float = 0.0,
        method: Method = "trace",
        fresh: bool = False,
    ) -> DirectionalScan:
        """Measure a sample at any directions of one side.

        Parameters
        ----------
        bsdf : Bsdf
            Of the sample; light meets its front from azimuth 180°.
        directions : array_like, shape (n, 3)
            Unit vectors to the detector: above the front for reflected light, below it for transmitted. Where the head of
            the detector would stand in the beam, nothing is measured.
        theta, rays, seed, method, fresh
            As of `measure`.
        turn : number
            By which the sample is turned about its normal, against the light that comes from azimuth 180° [°].

        Returns
        -------
        DirectionalScan
            Flux as a share of that of the beam.

        Raises
        ------
        ArgumentError, UnknownNameError
            As of `measure`; if directions are no unit vectors, or none is left.
        """
        measurement = self._measurement(bsdf, theta, rays, seed, method, turn=turn, fresh=fresh)
        return measurement.directional_scan(_rows(directions))

    def measure_window(
        self,
        bsdf: Bsdf,
        theta: float = 0.0,
        step: float = 0.5,
        span: float = 6.0,
        rays: int = 10**6,
        seed: int = 1,
        *,
        outside: float | None = None,
        turn: float = 0.0,
        way: Way | None = None,
        method: Method = "trace",
        fresh: bool = False,
    ) -> DirectionalScan:
        """Measure a sample in two dimensions: a window about the regular direction, and coarsely the hemisphere around it.

        Parameters
        ----------
        bsdf, theta, rays, seed, turn, way, method, fresh
            As of `measure` and `measure_directions`.
        step, span : number
            Between positions, and from the regular direction to the edges of the window [°].
        outside : number, optional
            Step over the rest of the hemisphere [°], 0.5 to 30; nothing is measured there if left out.

        Returns
        -------
        DirectionalScan

        Raises
        ------
        ArgumentError, UnknownNameError
            As of `measure`.
        """
        behind = _way(bsdf, way) == "transmitted"
        measurement = self._measurement(bsdf, theta, rays, seed, method, turn=turn, fresh=fresh)
        arms = window(theta, step, span, behind=behind)
        if outside is not None:
            arms = np.concatenate([arms, hemisphere_around(theta, outside, span + 0.5 * step, behind=behind)])
        return measurement.directional_scan(arms)

    def _measurement(
        self,
        bsdf: Bsdf,
        theta: float,
        rays: int,
        seed: int,
        method: Method,
        *,
        turn: float = 0.0,
        fresh: bool = False,
    ) -> Measurement:
        """Of a sample that is turned about its normal [°]."""
        require(bsdf, Bsdf, "bsdf", BSDF)
        require_number(turn, "turn", "an angle in °")
        return Measurement(
            bench=self.bench,
            head=self._head,
            counter=self._counter,
            wavelength=self.wavelength,
            bsdf=TurnedSample(bsdf, float(turn)) if turn else bsdf,
            theta=theta,
            rays=rays,
            seed=seed,
            method=method,
            fresh=fresh,
        )


def _rows(directions: npt.ArrayLike) -> Array:
    """Directions of a detector, shape (n, 3)."""
    found = as_numbers(directions, "directions", "unit vectors, shape (n, 3)", copy=True)
    if found.ndim != 2 or found.shape[1] != 3:
        raise ArgumentError(f"directions have shape {found.shape}; give unit vectors, shape (n, 3).")
    return found


def _way(bsdf: Bsdf, way: Way | None) -> Way:
    require(bsdf, Bsdf, "bsdf", BSDF)
    if way is not None:
        require_known(way, get_args(Way), "way")
        return way
    mirrored, straight, back, through = bsdf.ways
    if (mirrored or back) and (straight or through):
        raise ArgumentError(
            "the sample reflects and transmits: say which is measured, way='transmitted' or 'reflected'"
        )
    return "transmitted" if straight or through else "reflected"
