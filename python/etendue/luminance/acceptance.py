"""How wide the cone should be: the acceptance with the least estimated error."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import numpy.typing as npt

from etendue.luminance.cone import ConeEstimate
from etendue.quantities.observer import Screen

FloatArray = npt.NDArray[np.float64]

LADDER: tuple[float, ...] = tuple(0.25 * math.sqrt(2.0) ** k for k in range(12))
"""Acceptances tried [°]: 0.25° to 11.3°, each with twice the solid angle of the one before.

Wider cones would misstate even a Lambertian source by more than 1 %, which no error bar shows.
"""

ENOUGH_RAYS = 100
"""Rays that a rung must have seen before its difference to the next one is taken as evidence of blur."""

COARSE_PIXELS = 1 << 16
"""Most pixels of the grid on which acceptances are compared."""


@dataclasses.dataclass(frozen=True)
class AcceptanceChoice:
    """The acceptance chosen, and why.

    Parameters
    ----------
    acceptance : float
        [°]
    index : int
        Its place in the ladder.
    error : float
        Estimated root mean square error over the map, as a fraction of the map's root mean square.
    reason : str
        One sentence for people.
    """

    acceptance: float
    index: int
    error: float
    reason: str


def comparison_screen(screen: Screen) -> Screen:
    """The screen itself, or the same area with fewer pixels if it has more than `COARSE_PIXELS`."""
    pixels = screen.columns * screen.rows
    if pixels <= COARSE_PIXELS:
        return screen
    shrink = math.sqrt(COARSE_PIXELS / pixels)
    columns, rows = max(1, int(screen.columns * shrink)), max(1, int(screen.rows * shrink))
    return dataclasses.replace(screen, columns=columns, rows=rows)


def noise_of(estimate: ConeEstimate) -> FloatArray:
    """Expected Σ variance over the pixels of each rung, shape (rungs,) [square of the luminance].

    Of rays of unequal flux a narrow cone is likely to miss the few heavy ones, and looks less noisy than it is: then the
    mean square of the flux of the widest cone's rays stands for that of its own. Rays of equal flux are not touched by this.
    """
    seen = np.maximum(estimate.rays.sum(axis=(1, 2)), 1)
    mean_square = (estimate.variance * estimate.etendue**2).sum(axis=(1, 2)) / seen
    lift = np.divide(mean_square[-1], mean_square, out=np.ones_like(mean_square), where=mean_square > 0)
    return np.asarray(estimate.variance.sum(axis=(1, 2)) * np.maximum(lift, 1.0))


def equal_rays_of(estimate: ConeEstimate) -> FloatArray:
    """How many equal rays each rung's rays are as good as, (Σ w)² / Σ w², shape (rungs,); of equal rays their number."""
    total = (estimate.luminance * estimate.etendue).sum(axis=(1, 2))
    squares = (estimate.variance * estimate.etendue**2).sum(axis=(1, 2))
    # Half a ray, so that rounding takes none of the last of them away.
    return np.asarray(np.divide(total**2, squares, out=np.zeros_like(total), where=squares > 0) + 0.5)


def choose_acceptance(estimate: ConeEstimate, screen: Screen) -> AcceptanceChoice:
    r"""Pick the acceptance with the least estimated mean square error over the map.

    A narrow cone sees few rays (variance), a wide one blurs over angle (bias); the rung with the least sum of both is
    taken (theory eq. 15). The variance of each rung j of the ladder is known from the flux weights. The bias shows in
    the difference between a rung and the next narrower one, which for a Poisson process is noise only if there is none:

    .. math:: D_j = \sum_p \left[(L_j - L_{j-1})^2 - \mathrm{var}(L_j - L_{j-1})\right], \qquad
              \mathrm{E} D_j = \sum_p (b_j - b_{j-1})^2

    Cones are nested, so the covariance of two rungs is that of their common rays,
    :math:`\mathrm{var}(L_{j-1})\,G_{j-1}/G_j` with étendues G. Where luminance varies smoothly with angle, bias grows
    with the solid angle, which doubles from rung to rung: :math:`b_j = 2(b_j - b_{j-1})`. The squared bias of rung j is
    therefore taken as :math:`4 D_j`, or four times any :math:`D_i` of a narrower rung that stands out of its own noise by
    two standard deviations, whichever is larger: blur does not go away by widening the cone further. A rung
    that saw fewer than `ENOUGH_RAYS` rays, or rays as good as fewer equal ones, is no evidence of blur. The noise of a rung
    is taken from the mean square of the flux of its own rays or of the widest rung's, whichever is larger (`noise_of`).

    Parameters
    ----------
    estimate : ConeEstimate
        At all acceptances of `LADDER`, on `comparison_screen(screen)`.
    screen : Screen
        On which the map will be made; it may have more pixels, and then more variance per pixel.
    """
    angles = estimate.view.acceptances
    seen = estimate.rays.sum(axis=(1, 2))
    if seen[-1] == 0:
        reason = f"no ray heads for the observer within {angles[-1]:.3g}°; the widest acceptance was kept"
        return AcceptanceChoice(angles[-1], len(angles) - 1, math.nan, reason)
    lum, variance, etendue = estimate.luminance, estimate.variance, estimate.etendue
    step_variance = variance[1:] + variance[:-1] * (1.0 - 2.0 * etendue[:-1] / etendue[1:])
    step = (np.diff(lum, axis=0) ** 2 - step_variance).sum(axis=(1, 2))
    # A handful of rays that happen to share a pixel look like structure; they prove nothing.
    step = np.where(equal_rays_of(estimate)[:-1] >= ENOUGH_RAYS, step, 0.0)
    # A square of a normal variable has twice the square of its variance as variance.
    noise = np.sqrt(2.0 * (step_variance**2).sum(axis=(1, 2)))
    proven = np.maximum.accumulate(np.maximum(step - 2.0 * noise, 0.0))
    bias_squared = np.concatenate([[0.0], 4.0 * np.maximum(step, proven)]).clip(min=0.0)
    coarse = estimate.view.screen
    finer = screen.columns * screen.rows / (coarse.columns * coarse.rows)
    noise_squared = finer * noise_of(estimate)
    # Rungs that saw nothing have no variance to speak of, and no claim to be chosen.
    risk = np.where(seen > 0, bias_squared + noise_squared, np.inf)
    best = int(np.argmin(risk))
    scale = math.sqrt(float((lum[best] ** 2).sum()))
    blur, grain = math.sqrt(bias_squared[best]) / scale, math.sqrt(noise_squared[best]) / scale
    error = math.sqrt(float(risk[best])) / scale
    reason = (
        f"acceptance {angles[best]:.3g}° chosen from {angles[0]:.3g}° to {angles[-1]:.3g}° for the least estimated error: "
        f"noise {grain:.2%} and blur over angle {blur:.2%} of the map's root mean square"
    )
    return AcceptanceChoice(angles[best], best, error, reason)
