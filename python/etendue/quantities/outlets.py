"""Where maps go: into files and pictures, by functions of higher floors.

Nothing here takes a library, so that the package can be imported at once.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar, NamedTuple


class MapOutlets(NamedTuple):
    """Where maps go: functions of higher floors, which this one cannot import.

    Parameters
    ----------
    save : callable
        Of a map and a path; writes the file and returns what its format could not express.
    plot : callable
        Of a map, a path or None, and options of the picture; draws it.

    Examples
    --------
    >>> outlets = MapOutlets(save=lambda lmap, path: ("no colour",), plot=lambda lmap, path, **options: path.stem)
    >>> outlets.save(None, Path("map.hdr")), outlets.plot(None, Path("map.png"))
    (('no colour',), 'map')
    """

    save: Callable[[Any, Path], tuple[str, ...]]
    plot: Callable[..., Any]


class GoesOut:
    """A map that can be saved and drawn.

    Examples
    --------
    >>> import etendue as et
    >>> issubclass(et.LuminanceMap, GoesOut), callable(GoesOut.outlets.save)
    (True, True)
    """

    outlets: ClassVar[MapOutlets]
    """Set once, by the package itself (`etendue/__init__.py`), which alone knows all floors."""
