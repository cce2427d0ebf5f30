"""`Measurement`: a sample in the beam of a goniometer, and what the detector states of it; or the beam alone."""

from __future__ import annotations

import dataclasses
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from etendue.errors import ArgumentError
from etendue.instruments.bench import Bench
from etendue.instruments.detector_head import DetectorHead
from etendue.instruments.directional_scan import DirectionalScan
from etendue.instruments.goniometer_scan import GoniometerScan, Way
from etendue.instruments.photon_counter import PhotonCounter
from etendue.instruments.positions import Plane, detector_directions, even_angles
from etendue.instruments.ray_counting import counted_flux
from etendue.instruments.sight_quadrature import integrated_flux
from etendue.quantities.arguments import require_known, require_number
from etendue.quantities.bsdf_directions import direction, light_from
from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.polar_grid import PolarGrid
from etendue.scatter.bsdf import Bsdf

Array = npt.NDArray[np.float64]
Method = Literal["trace", "quadrature"]

SHARED = "all positions count the same rays: neighbours err together"
"""Note of scans whose errors are not independent."""

SQUARE = (
    "the aperture is square: what it shows of a point is not round, as the rings of deconvolve take it to be, whose peak "
    "may be off by more than half; deconvolve_directions knows the aperture"
)
"""Note of scans by a square aperture."""


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class Measurement:
    """A sample in the beam of a goniometer, at one angle of incidence.

    Parameters
    ----------
    bench : Bench
        Beam, aperture and distance.
    head : DetectorHead
        Which shadows the sample at some positions.
    counter : PhotonCounter
        What makes noise of the flux.
    wavelength : number
        In nm.
    bsdf : Bsdf
        Of the sample; light meets its front from azimuth 180°.
    theta : number
        Angle of incidence [°].
    rays : int
        At each position, if they are traced.
    seed : int
        Of the rays and of the noise.
    method : {"trace", "quadrature"}
        Rays drawn and counted, or integrals over beam and aperture.
    fresh : bool
        Draw rays of its own for each position.

    Raises
    ------
    ArgumentError
        If the angle of incidence is none from 0 to below 90°.
    UnknownNameError
        If there is no such method.

    Examples
    --------
    >>> import etendue as et
    >>> from etendue.instruments.beam_and_aperture import Aperture, Beam
    >>> measurement = Measurement(
    ...     bench=Bench(Beam(14.0), Aperture("disk", 25.0), 886.0), head=DetectorHead(0.0, 14.0, 886.0),
    ...     counter=PhotonCounter(), wavelength=550.0, bsdf=et.bsdf.Lambertian(reflectance=0.5),
    ...     theta=20.0, rays=1000, seed=1, method="quadrature",
    ... )
    >>> (measurement.scan("in-plane", 30.0, 30.0, "reflected").bsdf * np.pi).round(3).tolist()
    [0.5, 0.5, 0.5]
    """

    bench: Bench
    head: DetectorHead
    counter: PhotonCounter
    wavelength: float
    bsdf: Bsdf
    theta: float
    rays: int
    seed: int
    method: Method
    fresh: bool = False

    def __post_init__(self) -> None:
        require_known(self.method, get_args(Method), "method")
        require_number(self.theta, "theta", "an angle of incidence from 0 to below 90°")
        if not 0.0 <= self.theta < 90.0:
            raise ArgumentError(f"an angle of incidence of {self.theta:g}°; give 0 to below 90°")

    def flux(self, arms: Array, *, behind: bool) -> tuple[Array, Array]:
        """Share of the beam in the aperture at positions on one side of the sample, and its error; shapes (k,)."""
        if self.method == "trace":
            return counted_flux(
                self.bench,
                self.bsdf,
                arms,
                self.rays,
                self.seed,
                theta=self.theta,
                wavelength=self.wavelength,
                behind=behind,
                fresh=self.fresh,
            )
        return integrated_flux(self.bench, self.bsdf, arms, theta=self.theta, wavelength=self.wavelength, behind=behind)

    def flux_on_both_sides(self, arms: Array) -> tuple[Array, Array]:
        """The same at positions in front of the sample and behind it."""
        flux, error = np.zeros(len(arms)), np.zeros(len(arms))
        for behind in (False, True):
            own = np.flatnonzero((arms[:, 2] < 0.0) == behind)
            if own.size:
                flux[own], error[own] = self.flux(arms[own], behind=behind)
        return flux, error

    def scan(self, plane: Plane, step: float, span: float, way: Way) -> GoniometerScan:
        """The detector passes in one plane through the regular direction, in even steps to a span on both sides [°]."""
        angle = even_angles(self.theta if plane == "in-plane" else 0.0, step, span)
        # Beyond, the detector stands on the other side of the sample.
        angle = angle[np.abs(angle) < 90.0]
        behind = way == "transmitted"
        arms = detector_directions(angle, self.theta, plane, behind=behind)
        clear, notes = self._clear(arms)
        flux, error = self.flux(arms[clear], behind=behind)
        return _recorded(
            self.bench,
            self.counter,
            angle[clear],
            flux,
            error,
            self.seed,
            incidence=self.theta,
            way=way,
            plane=plane,
            sample=True,
            shared_rays=self._shared_rays,
            notes=notes,
        )

    def directional_scan(self, arms: Array) -> DirectionalScan:
        """The detector stands at any directions of one side, shape (n, 3)."""
        checked = DirectionalScan(arms, np.zeros(len(arms)), incidence=self.theta)
        clear, notes = self._clear(arms)
        arms = arms[clear]
        flux, error = self.counter.read(*self.flux(arms, behind=checked.behind), self.seed)
        return DirectionalScan(
            arms,
            flux,
            error,
            solid_angle=self.bench.solid_angle,
            incidence=self.theta,
            background=self.counter.background,
            bench=self.bench,
            shared_rays=self._shared_rays,
            notes=notes,
        )

    def slice_on(self, grid: PolarGrid, way: Way) -> BsdfSlice:
        """The BSDF on a grid about the normal, by eq. 5.1; NaN where the head of the detector stands in the beam."""
        behind = way == "transmitted"
        flat = direction(grid.radial[None, :], grid.azimuth[:, None], behind=behind).reshape(-1, 3)
        flux, error = self.counter.read(*self.flux(flat, behind=behind), self.seed)
        per = self.bench.solid_angle * np.abs(flat[:, 2])
        flux[self.head.shadows(flat, self.theta)] = np.nan
        return BsdfSlice(
            light_from(self.theta, 180.0),
            (flux / per).reshape(grid.shape),
            behind,
            grid=grid,
            wavelength=self.wavelength,
            standard_error=(error / per).reshape(grid.shape),
        )

    @property
    def _shared_rays(self) -> int:
        """Rays that all positions count."""
        return self.rays if self.method == "trace" and not self.fresh else 0

    def _clear(self, arms: Array) -> tuple[npt.NDArray[np.bool_], tuple[str, ...]]:
        """At which positions the head is not in the beam, shape (n,), and what is to be told of a scan."""
        shared = self.method == "trace" and not self.fresh and self.counter.photons is None
        notes = (SHARED,) if shared else ()
        shadowed = self.head.shadows(arms, self.theta)
        if shadowed.any():
            if shadowed.all():
                raise ArgumentError("the head of the detector stands in the beam at all positions")
            left_out = (
                f"{int(shadowed.sum())} positions are left out: the head of the detector stands in the beam there"
            )
            notes = (*notes, left_out)
        return ~shadowed, notes


def bare_scan(
    bench: Bench, counter: PhotonCounter, angle: Array, *, wavelength: float, rays: int | None, seed: int
) -> GoniometerScan:
    """The bare beam without a sample, scanned.

    Parameters
    ----------
    bench, counter, wavelength, seed
        As of `Measurement`.
    angle : array, shape (n,)
        Positions, from the axis of the beam [°].
    rays : int, optional
        Traced at each position; None: the flux is computed from the overlap of beam and aperture.

    Raises
    ------
    ArgumentError
        If there are no rays, or the seed is negative.

    Examples
    --------
    >>> from etendue.instruments.beam_and_aperture import Aperture, Beam
    >>> bench, angle = Bench(Beam(14.0), Aperture("disk", 25.0), 886.0), np.array([-1.0, 0.0, 1.0])
    >>> bare_scan(bench, PhotonCounter(), angle, wavelength=550.0, rays=None, seed=1).flux.round(3).tolist()
    [0.201, 1.0, 0.201]
    """
    if rays is None:
        flux, error = bench.beam.overlap(bench.aperture, angle, bench.distance), np.zeros(angle.shape)
    else:
        arms = detector_directions(angle, 0.0, "in-plane", behind=True)
        flux, error = counted_flux(bench, None, arms, rays, seed, theta=0.0, wavelength=wavelength, behind=True)
    return _recorded(
        bench,
        counter,
        angle,
        flux,
        error,
        seed,
        incidence=0.0,
        way="transmitted",
        plane="in-plane",
        sample=False,
    )


def _recorded(
    bench: Bench,
    counter: PhotonCounter,
    angle: Array,
    flux: Array,
    error: Array,
    seed: int,
    *,
    incidence: float,
    way: Way,
    plane: Plane,
    sample: bool,
    shared_rays: int = 0,
    notes: tuple[str, ...] = (),
) -> GoniometerScan:
    """What the detector states of a flux."""
    flux, error = counter.read(flux, error, seed)
    if bench.aperture.shape == "square":
        notes = (*notes, SQUARE)
    return GoniometerScan(
        angle,
        flux,
        error,
        solid_angle=bench.solid_angle,
        incidence=incidence,
        way=way,
        plane=plane,
        background=counter.background,
        sample=sample,
        shared_rays=shared_rays,
        notes=notes,
    )
