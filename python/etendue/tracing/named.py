"""What detectors saw, by the names of the detectors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Generic, TypeVar

from etendue.errors import ArgumentError
from etendue.quantities.arguments import require_known

T = TypeVar("T")


class ByName(Mapping[str, T], Generic[T]):
    """Values by the names of their detectors, in the order of the scene.

    Parameters
    ----------
    kind : str
        What the detectors are, for messages.
    values : mapping

    Raises
    ------
    UnknownNameError
        When asked for a name that there is none of; suggests the nearest.

    Examples
    --------
    >>> found = ByName("illuminance detector", {"floor": 1.0})
    >>> found["floor"], found.only
    (1.0, 1.0)
    >>> found["flor"]
    Traceback (most recent call last):
    etendue.errors.UnknownNameError: unknown illuminance detector 'flor'. Did you mean 'floor'? Known: floor.
    """

    def __init__(self, kind: str, values: Mapping[str, T]) -> None:
        self._kind = kind
        self._values = dict(values)

    def __getitem__(self, name: str) -> T:
        """What the detector of this name saw."""
        require_known(name, self._values, self._kind)
        return self._values[name]

    def __contains__(self, name: object) -> bool:
        """Whether there is a detector of this name."""
        return name in self._values

    def __iter__(self) -> Iterator[str]:
        """Names."""
        return iter(self._values)

    def __len__(self) -> int:
        """Number of detectors."""
        return len(self._values)

    def __repr__(self) -> str:
        """Say which names there are."""
        return f"<{self._kind}s: {', '.join(self._values) or 'none'}>"

    @property
    def only(self) -> T:
        """What the one detector of this kind saw.

        Raises
        ------
        ArgumentError
            If the scene has none, or several.
        """
        if len(self._values) != 1:
            named = f"{len(self._values)} of them ({', '.join(self._values)})" if self._values else "none"
            raise ArgumentError(f"the scene has {named}, not one {self._kind}.")
        return next(iter(self._values.values()))
