"""How sure a map is as a whole: two figures that dark pixels do not spoil."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

BRIGHT = 0.1
"""Share of the maximum from which a pixel counts as bright."""


@dataclasses.dataclass(frozen=True)
class RelativeError:
    """Standard error over value, for the pixels that hold the light.

    A median over all pixels says nothing: most of them may hold next to no light and be quite uncertain, while those that
    are looked at are well known.

    Parameters
    ----------
    flux_weighted : float
        Σ A σ/Σ A L over the pixels of known error, with A the apparent area of a pixel: the mean of σ/L, each pixel counted
        with its share of the flux.
    bright : float
        Median of σ/L over the pixels above `BRIGHT` of the maximum.

    Examples
    --------
    >>> found = RelativeError.of(np.array([[100.0, 50.0, 0.1, 0.0]]), np.array([[2.0, 2.0, 0.1, 0.0]]))
    >>> found.sentence("luminance")
    'standard error 2.732 % of the luminance, weighted by flux; median 3 % of the pixels above 10 % of the maximum'
    """

    flux_weighted: float
    bright: float

    @classmethod
    def of(cls, values: Array, standard_error: Array, area: npt.ArrayLike = 1.0) -> RelativeError | None:
        """That of a map; None if no pixel with light has a known error.

        Parameters
        ----------
        values, standard_error : array, shape (rows, columns)
            In one unit; NaN where dead or unknown.
        area : array_like
            Apparent area of each pixel, up to a factor.
        """
        with np.errstate(invalid="ignore"):
            known = np.isfinite(values) & np.isfinite(standard_error) & (values > 0.0)
        if not known.any():
            return None
        value, error = values[known], standard_error[known]
        weight = np.broadcast_to(np.asarray(area, np.float64), values.shape)[known]
        ratio = (error / value)[value >= BRIGHT * value.max()]
        return cls(float((weight * error).sum() / (weight * value).sum()), float(np.median(ratio)))

    def sentence(self, quantity: str) -> str:
        """Both figures, of a quantity such as ``"luminance"``."""
        return (
            f"standard error {100 * self.flux_weighted:.4g} % of the {quantity}, weighted by flux; median "
            f"{100 * self.bright:.4g} % of the pixels above {100 * BRIGHT:g} % of the maximum"
        )
