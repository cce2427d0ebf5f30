"""A number that an example found, beside what it must be by another way: an example that is wrong says so and fails."""

from __future__ import annotations

import etendue as et
import numpy as np

WIDE = 4.0
"""Standard errors by which a right number may be off: one in 16 000 is by chance."""


def agree(what: str, found: float, truth: float, error: float) -> None:
    """Print both, and stop the example if they differ by more than `WIDE` standard errors."""
    print(f"{what}: {found:.5g} ± {error:.2g}, expected {truth:.5g}")
    if not abs(found - truth) <= WIDE * error:
        raise SystemExit(
            f"{what}: found {found:.6g}, expected {truth:.6g}, which is more than {WIDE:g} × {error:.2g} off"
        )


def map_error(lmap: et.LuminanceMap) -> float:
    """Standard error of a map's intensity [cd], where the errors of its pixels are independent: of lines of sight."""
    return float(np.sqrt((lmap.standard_error**2).sum())) * lmap.screen.pixel_area * 1e-6


def table_error(table: et.Intensity, c: float, gamma: float) -> float:
    """Standard error of an intensity in a direction [cd], as if the nodes around it erred alike."""
    errors = table.replace(values=np.nan_to_num(table.standard_error))
    return float(errors.at(c=c, gamma=gamma))
