"""Final gathering: lines of sight that end at diffuse surfaces whose light is known, and their check by lines that go on."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from statistics import NormalDist

import numpy as np
import numpy.typing as npt

from etendue import _core

Array = npt.NDArray[np.float64]

BLOCKS = 4
"""Blocks along each side of a map in which its light is compared."""

FEWEST = 12.0
"""Degrees of freedom that the error of a block needs, to be judged as if it were normal."""

FIRST_CHECK = 1 << 20
"""Number of the first pass for comparison alone: beyond all passes of a map, so that no random number is shared."""

SIGNIFICANCE = 1e-4

PILOT = 2
"""Passes of a map that are made both ways: the fewest that tell an error, and as many as a comparison takes."""

GAIN = 3.0
"""Ratio of variances from which patches are used unasked: their rays cost up to as much as the lines themselves."""

LEAST_LINES = 1 << 19
"""Lines of sight of a map from which it is tried: of fewer, the survey alone would take longer."""

MOST_FACES = 10_000
"""Faces of a scene up to which it is tried: each has one patch or more, and of many each is met by few."""

MOST_SEGMENTS, SCOUTS = 100, 2000
"""Segments of a ray, the mean of so many rays, up to which it is tried: what a ray does is kept until its batch is done,
and where light goes to and fro for longer, rays take longer than lines.
"""

Look = Callable[[int, int, "_core.Survey | None"], list[list[Array]]]
"""The sums of each of the passes ``first..last`` of a map, with patches or without."""


def survey_notes(survey: _core.Survey) -> list[str]:
    """How much of the diffuse surfaces' light is known beforehand."""
    patches, usable = survey.patches()
    if not patches:
        why = "no surface with a diffuse base (which a table of lobes alone lacks) could be cut into patches"
        return [f"{why}: every line of sight was followed to the sources"]
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


@dataclasses.dataclass(frozen=True)
class Comparison:
    """How a map of lines that end at patches compares with lines that go on to the sources.

    Parameters
    ----------
    difference, error : float
        What the map has more of all light, and its standard error, relative to the lines that go on.
    farthest : float
        Difference of the block that differs most, in its standard errors.
    most : float
        What chance exceeds in one map of 10 000 (normal errors, Šidák's bound over the blocks).

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(1)
    >>> exact = [rng.normal(10.0, 1.0, (40, 30)) for _ in range(2)]
    >>> found = Comparison.of([blocks(rng.normal(10.0, 0.3, (40, 30))) for _ in range(16)], exact)
    >>> found.sentence, found.differs
    ('compared with lines of sight that go on to the sources: +0.10% ± 0.20% of all light', False)
    >>> round(found.bias, 4)
    0.002
    """

    difference: float
    error: float
    farthest: float
    most: float

    @classmethod
    def of(cls, gathered: list[Array], exact: list[Array]) -> Comparison | None:
        """The comparison of a map; None if too few pixels have light for one.

        Parameters
        ----------
        gathered : list of ndarray
            `blocks` of each pass of the map.
        exact : list of ndarray, shape (rows, columns)
            Two passes of lines of sight that go on.
        """
        passes = np.array(gathered)
        value, variance = passes.mean(axis=0), passes.var(axis=0, ddof=1) / len(passes)
        one, two = exact
        # Pixels are independent of each other: the variance of a mean of two is a quarter of the square of their difference.
        other, apart = blocks(one + two) / 2.0, blocks((one - two) ** 2) / 4.0
        error = np.sqrt(variance + apart)
        # As many pixels as bear the variance: of few, two passes do not tell it.
        known = 16.0 * apart**2 > FEWEST * blocks((one - two) ** 4)
        if not known.any() or not other[-1] > 0.0:
            return None
        z = np.abs(value - other)[known] / error[known]
        most = -NormalDist().inv_cdf(-np.expm1(np.log1p(-SIGNIFICANCE) / known.sum()) / 2)
        return cls(float(value[-1] / other[-1] - 1.0), float(error[-1] / other[-1]), float(z.max()), float(most))

    @property
    def differs(self) -> bool:
        """Whether a block differs by more than chance does."""
        return self.farthest > self.most

    @property
    def bias(self) -> float:
        """What all pixels may err by in common, relative: the difference, or what of it cannot be told from chance."""
        return max(abs(self.difference), self.error)

    @property
    def sentence(self) -> str:
        """A note for the map."""
        light = f"{self.difference:+.2%} ± {self.error:.2%} of all light"
        return f"compared with lines of sight that go on to the sources: {light}"

    @property
    def warning(self) -> str:
        """What is added where the map differs, though patches were asked for."""
        return (
            f"; a part of the map differs by {self.farthest:.1f} standard errors: leave gather out, or add forward_rays"
        )


def common_spread(gathered: list[Array]) -> float:
    """Relative standard error of all light of a map, of the `blocks` of its passes: patches lend their noise to all pixels.

    Examples
    --------
    >>> import numpy as np
    >>> round(common_spread([np.array([1.0, 9.0]), np.array([3.0, 11.0])]), 3)     # 1/10
    0.1
    """
    light = np.array([part[-1] for part in gathered])
    return float(light.std(ddof=1) / (math.sqrt(len(light)) * light.mean())) if light.any() else 0.0


UNKNOWN = "too few pixels with light for a comparison with lines of sight that go on to the sources"

NOT_TAKEN = (
    "patches of diffuse surfaces with known light were tried and left out: a part of the map differed from lines of sight "
    "that go on to the sources by more than chance does"
)


@dataclasses.dataclass(frozen=True)
class Pilot:
    """The first passes of a map both ways, which tell the better one.

    Parameters
    ----------
    exact, gathered : list of list of ndarray
        `PILOT` passes each, of lines that go on to the sources and of lines that end at patches.
    gain : float
        Square of the ratio of their errors, weighted by flux.

    Examples
    --------
    >>> import numpy as np
    >>> rng = np.random.default_rng(2)
    >>> one = lambda survey: [rng.normal(10.0, 1.0 if survey is None else 0.25, (40, 30))]
    >>> noisy = lambda first, last, survey: [one(survey) for _ in range(first, last)]
    >>> exact = noisy(0, PILOT, None)
    >>> found = Pilot.of(exact, noisy, "a survey", np.ones((40, 30)))
    >>> bool(12 < found.gain < 20), found.pays
    (True, True)
    """

    exact: list[list[Array]]
    gathered: list[list[Array]]
    gain: float

    @classmethod
    def of(cls, exact: list[list[Array]], look: Look, survey: _core.Survey, area: Array) -> Pilot:
        """The passes that follow `exact`, made with patches, beside these.

        Parameters
        ----------
        exact : list of list of ndarray
            The first `PILOT` passes of a map.
        look : callable
            The sums of passes, with or without patches.
        survey : Survey
            The patches.
        area : ndarray
            Apparent area of the pixels, up to a factor.
        """
        gathered = look(PILOT, 2 * PILOT, survey)
        (one, two), (three, four) = ([found[0] * area for found in passes] for passes in (exact, gathered))
        apart = np.abs(three - four).sum() * (one + two).sum()
        whole = np.abs(one - two).sum() * (three + four).sum()
        return cls(exact, gathered, float((whole / apart) ** 2) if apart > 0.0 else 0.0)

    @property
    def pays(self) -> bool:
        """Whether patches are worth their rays, and show what is there."""
        seen = Comparison.of([blocks(found[0]) for found in self.gathered], [found[0] for found in self.exact])
        return self.gain > GAIN and seen is not None and not seen.differs

    @property
    def sentence(self) -> str:
        """A note for the map."""
        return (
            f"in a pilot, the variance of lines of sight that go on to the sources was {self.gain:.1f} times that of lines "
            "that end there"
        )
