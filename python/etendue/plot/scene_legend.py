"""What colours and lines of a drawn scene mean."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from etendue.plot.scene_layout import SceneLayout
from etendue.plot.scene_parts import FINISH_KINDS

if TYPE_CHECKING:
    from matplotlib.artist import Artist

FINISH_LINES: dict[str, dict[str, Any]] = {
    "interface": {"color": "#4d5a66", "linewidth": 0.9},
    "mirror": {"color": "#1f5aa6", "linewidth": 2.0},
    "diffuse": {"color": "#3c8d5a", "linewidth": 2.4, "linestyle": (0, (1.6, 0.7))},
    "transparent": {"color": "#6b6b76", "linewidth": 1.0, "linestyle": (0, (1.0, 1.5))},
    "absorber": {"color": "#1c1c22", "linewidth": 2.4},
}
"""By what a finish does: told apart by width and dashes as well as by colour."""

FILLS = ("#d8e7f6", "#fbefbf", "#a9c6e3", "#e6cd8c", "#e3e3e8", "#7f9fc4", "#c4c7d0", "#f3dcae")
"""Of media: blues, yellows and greys in alternating depth, which all eyes tell apart."""
OPAQUE = "#8d9199"
"""Of solids that no light enters."""
SOURCE, RAY, DETECTOR, OBSERVER = "#d1622b", "#b8862b", "#8a4fa3", "#5b6770"


def legend_handles(layout: SceneLayout) -> list[tuple[Artist, str]]:
    """Media with their solids, then finishes, sources, rays and detectors, if shown: how they look, and words.

    Examples
    --------
    >>> from etendue.plot.scene_layout import lay_out_scene
    >>> from etendue.scene import Scene
    >>> ball = {"name": "ball", "shape": {"kind": "ball", "radius": 2}, "medium": "BK7"}
    >>> [text for _, text in legend_handles(lay_out_scene(Scene(solids=[ball])))]
    ['ball: BK7, n = 1.518', 'interface']
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[tuple[Artist, str]] = []
    solids = {part.name: part for view in layout.views for part in view.solids}
    edge = {"edgecolor": FINISH_LINES["interface"]["color"], "linewidth": 0.6}
    for number, colour in fill_colours(layout).items():
        name, index = layout.media[number]
        filled = [part.name for part in solids.values() if part.medium == number]
        if filled:
            # A medium that is described in its solid has the solid's name.
            what = "" if name in {f"{solid}.medium" for solid in filled} else f"{name}, "
            text = f"{_listed(filled, 36)}: {what}n = {index:.4g}"
            handles.append((Patch(facecolor=colour, **edge), text))
    if layout.media[0][1] != 1.0:
        name, index = layout.media[0]
        handles.append((Patch(facecolor="white", **edge), f"surroundings: {name}, n = {index:.4g}"))
    opaque = [part.name for part in solids.values() if part.medium is None]
    if opaque:
        handles.append((Patch(facecolor=OPAQUE, **edge), f"{_listed(opaque, 36)}: opaque"))
    kinds = {face.kind for view in layout.views for face in view.faces}
    handles += [(Line2D([], [], **FINISH_LINES[kind]), kind) for kind in FINISH_KINDS if kind in kinds]
    if any(view.sources for view in layout.views):
        handles.append((Line2D([], [], color=SOURCE, linewidth=2.6), "source"))
    if any(view.trails for view in layout.views):
        handles.append((Line2D([], [], color=RAY, linewidth=0.9), "ray"))
    if any(view.detectors for view in layout.views):
        handles.append((Line2D([], [], color=DETECTOR, linewidth=1.2, linestyle="--"), "detector"))
    return handles


def _listed(names: list[str], most: int) -> str:
    """As many names as fit into so many letters, at least one."""
    shown = [name for i, name in enumerate(names) if i == 0 or len(", ".join(names[: i + 1])) <= most]
    more = f" and {len(names) - len(shown)} more" if len(shown) < len(names) else ""
    return shortened(", ".join(shown), most) + more


def shortened(text: str, most: int) -> str:
    """A text of at most so many letters.

    Examples
    --------
    >>> shortened("encapsulation", 8)
    'encapsu…'
    """
    return text if len(text) <= most else text[: most - 1].rstrip(", ") + "…"


def fill_colours(layout: SceneLayout) -> dict[int, str]:
    """The colour of each medium that fills a solid, by its number; that of the surroundings is white.

    Examples
    --------
    >>> from etendue.plot.scene_layout import lay_out_scene
    >>> from etendue.scene import Scene
    >>> fill_colours(lay_out_scene(Scene(solids=[{"shape": {"kind": "ball", "radius": 2}, "medium": "air"}])))
    {0: '#ffffff'}
    """
    used = sorted({part.medium for view in layout.views for part in view.solids if part.medium is not None})
    others = [number for number in used if number != 0]
    return {n: "#ffffff" for n in used if n == 0} | {n: FILLS[i % len(FILLS)] for i, n in enumerate(others)}
