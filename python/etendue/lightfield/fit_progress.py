"""How far a fit is, from its start to its end, in numbers of rays."""

from __future__ import annotations

from collections.abc import Callable

from etendue.quantities.ray_stream import Progress

Step = Callable[[], None]

STAGES = {"surface": 2e8, "focus": 3e7, "grid": 5e7, "recipe": 2e7, "field": 4e7, "errors": 6e7}
"""What the stages beside counting cost, in rays that are counted meanwhile: some seconds each, for any number of rays."""

PART_OF_REST = 0.15
"""Share of what is left of a stage that a step of it moves on: how many steps there will be is not known before."""


class FitProgress:
    """Tells the progress of a fit as if its stages were rays that are read.

    Parameters
    ----------
    progress : callable, optional
        Called with numbers that rise to `rays`.
    rays : int
        Of the set.
    automatic : bool
        Whether the surface is to be chosen, which is the longest stage.

    Examples
    --------
    >>> seen = []
    >>> fit = FitProgress(seen.append, 10**9, automatic=False)
    >>> fit.begin("grid"); fit.step(); fit.step(); fit.counted(10**9); fit.end()
    >>> seen == sorted(seen), seen[0], seen[-1]
    (True, 25000000, 1000000000)
    """

    def __init__(self, progress: Progress | None, rays: int, automatic: bool) -> None:
        self._progress, self._rays = progress, rays
        self._stages = {name: cost for name, cost in STAGES.items() if automatic or name != "surface"}
        self._whole = sum(self._stages.values()) + rays
        self._before, self._own, self._done = 0.0, 0.0, 0.0
        self._most = 0.0

    def begin(self, stage: str) -> None:
        """A stage begins; those before it have ended."""
        names = list(self._stages)
        counted = self._rays if names.index(stage) > names.index("grid") else 0
        self._before = counted + sum(self._stages[name] for name in names[: names.index(stage)])
        self._own, self._done = self._stages[stage], 0.0
        self._tell(self._before)

    def step(self) -> None:
        """Some of the stage is done."""
        self._done += PART_OF_REST * (1.0 - self._done)
        self._tell(self._before + self._done * self._own)

    def counted(self, rays: int) -> None:
        """So many of all rays were counted."""
        self._tell(sum(self._stages[name] for name in self._stages if name in ("surface", "focus", "grid")) + rays)

    def end(self) -> None:
        """All is done."""
        self._tell(self._whole)

    def _tell(self, done: float) -> None:
        if self._progress is not None:
            # Of several fits those after the first count as nothing.
            self._most = max(self._most, done)
            self._progress(int(self._rays * self._most / self._whole))
