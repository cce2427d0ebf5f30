"""`SourceKind`: what a kind of source is called, and which methods of estimating luminance take it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from etendue.errors import ArgumentError
from etendue.formats.rays.ray_index import RayIndex
from etendue.lightfield.light_field import LightField
from etendue.luminance.methods import AnyMethod, Cone, FromField, PathTracing
from etendue.quantities.ray_stream import RayStream
from etendue.scene import Scene
from etendue.scene.scatter_events import ScatterEvents


@dataclasses.dataclass(frozen=True)
class SourceKind:
    """What a kind of source can be looked at by.

    Parameters
    ----------
    words : str
        What it is, with its article.
    methods : tuple of type
        Those that take it; the first one is meant by ``"auto"`` if no option tells.
    without : mapping
        Options that mean nothing for this kind, with the reason.
    only_if : str, optional
        Option that has to be stated with others under ``"auto"``: without any the source is looked at by no method, but
        shows what it holds.
    """

    words: str
    methods: tuple[type[AnyMethod], ...]
    without: Mapping[str, str] = dataclasses.field(default_factory=dict)
    only_if: str | None = None


RAYS = SourceKind("a ray set", (FromField, Cone))
# An index was built for the cone alone, which it makes a matter of milliseconds.
INDEX = SourceKind("an index of rays", (Cone, FromField))
FIELD = SourceKind("a light field", (FromField,), {"surface": "a light field has its carrier surface already"})
SCENE = SourceKind("a scene", (PathTracing,))
EVENTS = SourceKind(
    "scatter events",
    (PathTracing,),
    {"forward_rays": "scatter events are rays traced forwards already"},
    only_if="rays_per_pixel",
)


def kind_of_source(source: RayStream | LightField | Scene | ScatterEvents) -> SourceKind:
    """What a source can be looked at by.

    Raises
    ------
    ArgumentError
        If it is none.

    Examples
    --------
    >>> import etendue as et
    >>> kind_of_source(et.RingSource()).words
    'a ray set'
    """
    if isinstance(source, Scene):
        return SCENE
    if isinstance(source, ScatterEvents):
        return EVENTS
    if isinstance(source, LightField):
        return FIELD
    if not isinstance(source, RayStream):
        raise ArgumentError(
            f"a {type(source).__name__} is no source of light that can be looked at; give rays, a light field, a scene, the "
            "scatter events of a trace, or the path of a file."
        )
    return INDEX if isinstance(source, RayIndex) else RAYS
