"""Final gathering: lines of sight that end at diffuse surfaces whose light is known, and their check by lines that go on."""

from __future__ import annotations

from statistics import NormalDist

import numpy as np
import numpy.typing as npt

from etendue import _core

Array = npt.NDArray[np.float64]

BLOCKS = 4
"""Blocks along each side of a map in which its light is compared."""

FEWEST = 12.0
"""Degrees of freedom that the error of a block needs, to be judged as if it were normal."""

CHECKS = 2
"""Passes whose lines of sight go on to the sources, for comparison: two, so that each pixel tells its error."""

FIRST_CHECK = 1 << 20
"""Number of the first of them: beyond all passes of a map, so that no random number is shared."""

SIGNIFICANCE = 1e-4


def survey_notes(survey: _core.Survey) -> list[str]:
    """How much of the diffuse surfaces' light is known beforehand."""
    patches, usable = survey.patches()
    if not patches:
        return ["no diffuse surface could be cut into patches: every line of sight was followed to the sources"]
    return [f"lines of sight end at {patches:,} patches of diffuse surfaces, {usable:.0%} of them with known light"]


def blocks(values: Array) -> Array:
    """Sums over `BLOCKS` x `BLOCKS` blocks of a map, and over all of it, as one vector.

    Examples
    --------
    >>> import numpy as np
    >>> blocks(np.ones((8, 4)))
    array([ 2.,  2.,  2.,  2.,  2.,  2.,  2.,  2.,  2.,  2.,  2.,  2.,  2.,
            2.,  2.,  2., 32.])
    """
    parts = [part for row in np.array_split(values, BLOCKS) for part in np.array_split(row, BLOCKS, axis=1)]
    return np.array([*(part.sum() for part in parts), values.sum()])


def comparison_note(gathered: list[Array], exact: list[Array]) -> str:
    """What a comparison of the map with lines of sight that go on to the sources says.

    Parameters
    ----------
    gathered : list of ndarray
        `blocks` of each pass of the map.
    exact : list of ndarray, shape (rows, columns)
        Two passes of lines of sight that go on.

    Returns
    -------
    str
        A note for the map. It asks to leave gathering out if a block differs by more than chance does in one map of 10 000
        (normal errors, Šidák's bound over the blocks).

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(1)
    >>> exact = [rng.normal(10.0, 1.0, (40, 30)) for _ in range(2)]
    >>> comparison_note([blocks(rng.normal(10.0, 0.3, (40, 30))) for _ in range(16)], exact)
    'compared with lines of sight that go on to the sources: +0.10% ± 0.20% of all light'
    """
    passes = np.array(gathered)
    value, variance = passes.mean(axis=0), passes.var(axis=0, ddof=1) / len(passes)
    one, two = exact
    # Pixels are independent of each other: the variance of a mean of two is a quarter of the square of their difference.
    other, apart = blocks(one + two) / 2.0, blocks((one - two) ** 2) / 4.0
    error = np.sqrt(variance + apart)
    # As many pixels as bear the variance: of few, two passes do not tell it.
    known = 16.0 * apart**2 > FEWEST * blocks((one - two) ** 4)
    if not known.any():
        return "too few pixels with light for a comparison with lines of sight that go on to the sources"
    z = np.abs(value - other)[known] / error[known]
    most = -NormalDist().inv_cdf(-np.expm1(np.log1p(-SIGNIFICANCE) / known.sum()) / 2)
    total = f"{value[-1] / other[-1] - 1:+.2%} ± {error[-1] / other[-1]:.2%}" if other[-1] > 0 else "dark"
    said = f"compared with lines of sight that go on to the sources: {total} of all light"
    if z.max() > most:
        said += f"; a part of the map differs by {z.max():.1f} standard errors: leave gather out, or add forward_rays"
    return said
