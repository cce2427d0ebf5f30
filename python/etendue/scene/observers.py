"""Who looks at a scene: observers by name, each with a screen."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Literal

from etendue.description.keys import Description
from etendue.description.values import Number, Vector
from etendue.quantities.observer import Observer, Screen


class ScreenKeys(Description):
    """The pixel grid of an observer; its keys are those of `etendue.Screen`.

    Examples
    --------
    >>> ScreenKeys(width=25, height=25, columns=128, rows=128).screen().shape
    (128, 128)
    """

    INSTEAD: ClassVar[Mapping[str, str]] = MappingProxyType({
        "pixels": "columns and rows",
        "size": "width and height in mm",
    })  # fmt: skip

    width: Number
    height: Number
    columns: int
    rows: int
    plane: Literal["view", "xy"] = "view"

    def model_post_init(self, _context: Any) -> None:
        """Refuse what no screen is."""
        self.screen()

    def screen(self) -> Screen:
        """The screen itself."""
        return Screen(self.width, self.height, self.columns, self.rows, self.plane)


class ObserverKeys(Description):
    """An observer; its keys are those of `etendue.Observer`, and a name and a screen.

    Examples
    --------
    >>> screen = {"width": 25, "height": 25, "columns": 128, "rows": 128}
    >>> ObserverKeys(name="side", theta=90, phi=0, distance=1000, screen=screen).observer().distance
    1000.0
    """

    INSTEAD: ClassVar[Mapping[str, str]] = MappingProxyType({
        **dict.fromkeys(
            ("position", "at"), "where it stands by theta, phi and distance, and what it looks at by target"
        ),
        **dict.fromkeys(
            ("size", "pixels"), "its screen: screen = {{ width = 25, height = 25, columns = 128, rows = 128 }}"
        ),
    })  # fmt: skip

    name: str = ""
    theta: Number = 0.0
    phi: Number = 0.0
    distance: Number
    target: Vector = (0.0, 0.0, 0.0)
    up: Vector | None = None
    roll: Number = 0.0
    screen: ScreenKeys

    def model_post_init(self, _context: Any) -> None:
        """Refuse what no observer is."""
        self.observer()

    def observer(self) -> Observer:
        """The observer alone."""
        return Observer(self.theta, self.phi, self.distance, self.target, self.up, self.roll)
