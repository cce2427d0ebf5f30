"""The present view by lines of sight through a scene, in the background, until another view comes."""

from __future__ import annotations

import dataclasses
import threading

from etendue.luminance.estimate import luminance_map
from etendue.quantities.luminance_map import LuminanceMap
from etendue.quantities.observer import Observer, Screen
from etendue.scene import Scene

PASSES = ((4, 8), (2, 16), (2, 64), (1, 64))
"""Pixels of the page along each side of a pixel, and lines of sight in each."""


class Superseded(Exception):  # noqa: N818 - nothing went wrong: somebody looks from elsewhere
    """Another view has been asked for."""


@dataclasses.dataclass(frozen=True)
class Progress:
    """How far the refinement is.

    Parameters
    ----------
    words : str
        For the page.
    lmap : LuminanceMap or None
        The last pass that has ended.
    number : int
        How many passes have ended.
    done : bool
        Whether that was the last.
    """

    words: str
    lmap: LuminanceMap | None
    number: int
    done: bool


class Refinement:
    """One thread that works on one view.

    Parameters
    ----------
    scene : Scene
    observer : Observer
    screen : Screen
        Of the page.
    threads : int, optional
        All cores if None.
    """

    def __init__(self, scene: Scene, observer: Observer, screen: Screen, threads: int | None = None) -> None:
        self._scene, self._observer, self._screen, self._threads = scene, observer, screen, threads
        self._changed = threading.Condition()
        self._progress = Progress("lines of sight are followed …", None, 0, done=False)
        self._superseded = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Give up as soon as the pass that runs tells how far it is, and wait for that."""
        self._superseded = True
        self._thread.join()

    def after(self, number: int, seconds: float) -> Progress:
        """How far it is, at once if more than `number` passes have ended, else after so many seconds at most."""
        with self._changed:
            self._changed.wait_for(lambda: self._progress.number > number or self._progress.done, seconds)
            return self._progress

    def _tell(self, progress: Progress) -> None:
        with self._changed:
            self._progress = progress
            self._changed.notify_all()

    def _run(self) -> None:
        last: LuminanceMap | None = None
        try:
            for number, (coarseness, lines) in enumerate(PASSES):
                last = self._pass(number, coarseness, lines, last)
        except Superseded:
            self._tell(dataclasses.replace(self._progress, done=True))
        except Exception as error:  # noqa: BLE001 - whatever it is, the page shows it
            self._tell(Progress(f"lines of sight failed: {error}", None, self._progress.number, done=True))

    def _pass(self, number: int, coarseness: int, lines: int, last: LuminanceMap | None) -> LuminanceMap:
        whole = self._screen
        columns, rows = (max(1, n // coarseness) for n in (whole.columns, whole.rows))
        screen = Screen(whole.width, whole.height, columns, rows)
        total = lines * columns * rows

        def told(done: int) -> None:
            if self._superseded:
                raise Superseded
            words = f"lines of sight: pass {number + 1} of {len(PASSES)}, {min(done / total, 1):.0%}"
            self._tell(Progress(words, last, number, done=False))

        told(0)
        lmap = luminance_map(
            self._scene,
            self._observer,
            screen,
            rays_per_pixel=lines,
            # Caustics need rays from the sources as well, which take their time: in the last pass.
            forward_rays=None if number + 1 == len(PASSES) else 0,
            threads=self._threads,
            progress=told,
        )
        done = number + 1 == len(PASSES)
        words = f"by lines of sight: {lines} in each of {columns} × {rows} pixels" + ("" if done else " so far")
        self._tell(Progress(words, lmap, number + 1, done=done))
        return lmap
