"""The peak of a scan, less what chance lifts the largest of its values by."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from etendue.instruments.directional_scan import DirectionalScan
from etendue.instruments.goniometer_scan import GoniometerScan
from etendue.quantities.unlifted import Unlifted, unlifted


def scan_peak(scan: GoniometerScan | DirectionalScan) -> Unlifted:
    """The largest f of a scan [1/sr], less what chance lifts it by, and its standard error; NaN if no error is known.

    `unlifted` counts half of the values, since nodes of a far field share rays with those beside them. So do positions
    that are closer than the aperture is wide, as seen from the sample; of those further apart every one counts.

    Raises
    ------
    ArgumentError
        If the solid angle is not known, or a detector stood in the plane of the sample.

    Examples
    --------
    >>> import etendue as et
    >>> paper = et.bsdf.Lambertian(reflectance=0.8)
    >>> scan = et.ScatterGoniometer().measure(paper, 20, 5, 100_000, span=60)
    >>> bool(scan.bsdf.max() > 0.40), bool(abs(scan_peak(scan).value - 0.8 / np.pi) < 2 * scan_peak(scan).error)
    (True, True)
    """
    values, errors = scan.bsdf, scan.bsdf_error
    if errors is None:
        return Unlifted(float(values.max()), math.nan)
    return unlifted(values, errors, 2.0 * np.clip(_steps(scan) / _aperture(scan), 0.5, 1.0))


def _steps(scan: GoniometerScan | DirectionalScan) -> npt.NDArray[np.float64]:
    """From each position to the next [°]."""
    return np.full(scan.flux.shape, scan.step) if isinstance(scan, GoniometerScan) else scan.spacing


def _aperture(scan: GoniometerScan | DirectionalScan) -> float:
    """About how wide the aperture is [°]."""
    return math.degrees(math.sqrt(scan.solid_angle or math.pi))
