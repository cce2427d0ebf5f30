"""The numbers that steer the selection of a carrier surface, in one place, because they depend on each other."""

from __future__ import annotations

import dataclasses

Grid = tuple[int, int]
"""Halvings of each coordinate of the place, and of each of the direction."""


@dataclasses.dataclass(frozen=True)
class SelectionSettings:
    """How many rays are used, on which grids surfaces are scored, and what counts as better.

    Where no other source is stated, a value was found by trial: it is a round number with which the sources of
    ``tests/lightfield/test_selection.py``, whose best surface is known, get that surface. Whoever changes one runs those
    tests again.

    Parameters
    ----------
    compared_rays : int
        Rays on which the final surfaces are compared. The error of a difference of scores falls with its root; time rises
        in proportion. More than `fine_grids_from`, or the fine grids are never used.
    search_rays : int
        Of those, the rays on which depths over the whole range, and surfaces of one kind, are compared. They only have to
        find the neighbourhood of the best depth, to within `depth_window`; with too few it is missed.
    folds : int
        One ray in so many is held out. More leave more rays to the fit and fewer to the score.
    one_fold_from : int
        Compared rays from which on one fold is enough. Of fewer, folds are held out in turn until as many rays have been as
        one fold of these holds, or all of them; each takes as long as the first.
    search_one_fold_from : int
        The same for the search rays, whose scores need to be less certain.
    fine_grids_from : int
        Compared rays from which on the grids below are used as they stand. With fewer, each coordinate is halved once less,
        and with fewer than a sixteenth of them twice less: as many rays are then left for each cell. Finer grids show
        sharper edges, but only if their cells hold rays.
    concentration : float
        Of the trees that are scored: between ½ and 3 the scores of 100 thousand rays change by 0.001 nat.
    lead : float
        Standard errors of the difference by which a less simple surface must lead: at 3, chance prefers it in about one
        comparison of a thousand. Smaller values choose complicated surfaces for simple sources.
    least_lead : float
        [nat per ray] A smaller lead shows in no map, however certain it is.
    most_unmet : float
        Share of the flux, beside that of strays, from which on a surface that leaves it unmet is not chosen, whatever its
        score: the flux of maps may be low by so much. What is far off and has more of the flux is not taken for strays.
    least_size : float
        Least size of a surface, against the coordinates of the rays: below it rounding alone may have made the source. A
        larger value enlarges small sources far from the origin.
    nested_trims : tuple of float
        Shares of the rays beyond each side of the nested rectangles on which depths are compared: a die, and what lies about
        it. They fit any source well enough to find the neighbourhood of its depth.
    coarse_grid : tuple of int
        Grid on which the search rays compare depths, and surfaces of one kind.
    depth_grid : tuple of int
        Grid on which the compared rays seek the sharpest depth. It is finer in direction than in place by as much as keeps
        the edge of the source visible.
    kind_grids : tuple of (grid, finer grids)
        Grids on which the compared rays compare kinds: one for sources with more structure in place, one for those with
        more in direction; then the finer ones for surfaces that are not hopeless.
    hopeless_lag : float
        Lag behind the best score [nat per ray] from which on finer grids are not tried. A smaller
        value saves time, and drops surfaces that finer grids would have made the best.
    depth_step : float
        Steps of depth in which the source is searched, in radii of the smallest ball about it. It must not exceed the width
        of the maximum of the score.
    depth_doublings : int
        Doublings of that radius over which depths outside the ball are tried: 8 reach 256 radii.
    depth_window : float
        Share of two steps to either side of the depth that the search rays find, within which the compared rays seek it; the
        search rays find it to this width. Round depths within it are preferred.
    depth_tolerance : float
        Share of two steps to which the sharpest depth is found. Time rises with its logarithm.
    most_backwards : float
        Share of the flux towards −Z from which on surfaces that shine towards +Z alone are not tried.
    aslant : float
        Length of the mean direction from which on a source has a front, and the largest component of it along Z of a source
        that looks aside.
    least_tilt : float
        Angle to +Z [°] from which on flat surfaces that look where the source does are tried.

    Examples
    --------
    >>> SelectionSettings().search_rays < SelectionSettings().compared_rays
    True
    """

    compared_rays: int = 1 << 17
    search_rays: int = 1 << 15
    folds: int = 5
    one_fold_from: int = 1 << 15
    search_one_fold_from: int = 1 << 12
    fine_grids_from: int = 1 << 16
    concentration: float = 1.0
    lead: float = 3.0
    least_lead: float = 1e-3
    most_unmet: float = 0.01
    least_size: float = 1e-9
    nested_trims: tuple[float, ...] = (0.15, 0.02, 1e-3)
    coarse_grid: Grid = (4, 2)
    depth_grid: Grid = (5, 3)
    kind_grids: tuple[tuple[Grid, tuple[Grid, ...]], ...] = (
        ((5, 2), ((5, 3), (6, 2))),
        ((3, 4), ((3, 5), (4, 4))),
    )
    hopeless_lag: float = 0.15
    depth_step: float = 0.125
    depth_doublings: int = 8
    depth_window: float = 0.15
    depth_tolerance: float = 0.01
    most_backwards: float = 0.5
    aslant: float = 0.3
    least_tilt: float = 1.0

    def coarser(self, rays: int) -> int:
        """Halvings of each coordinate that are left out where so many rays are compared; see `fine_grids_from`.

        Examples
        --------
        >>> [SelectionSettings().coarser(rays) for rays in (100_000, 65_000, 4_000)]
        [0, 1, 2]
        """
        return int(rays < self.fine_grids_from) + int(16 * rays < self.fine_grids_from)


DEFAULT = SelectionSettings()
"""What ``surface="auto"`` uses."""
