"""Faces of solids that scatter light through them by stated shares, where it should be refracted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from etendue.scatter.members import parts_of
from etendue.scene.colour_dependence import index_of

Array = npt.NDArray[np.float64]
Record = dict[str, Any]

ALIKE = 1e-3
"""Refractive indices that differ by less are alike: luminances are wrong by twice as much."""


def unrefracted(
    record: Record, solid_names: Sequence[str], finish_names: Sequence[str], wavelength: Array
) -> Iterator[str]:
    """Solids with a finish that scatters light through a face between media of unlike index at some wavelengths [nm].

    A share of the flux says nothing of refraction, and leaves the law that L/n² is the same on both sides.

    Examples
    --------
    >>> from etendue.scene import Scene, compile_scene
    >>> opal = {"kind": "lambertian", "reflectance": 0.3, "transmittance": 0.6}
    >>> slab = {"shape": {"kind": "block", "width": 9, "height": 9, "depth": 2}, "finish": opal, "medium": {"index": 1.0}}
    >>> record = compile_scene(Scene(solids=[slab])).record
    >>> glass = {"index": {"kind": "constant", "n": 1.5}}
    >>> told, = unrefracted({**record, "media": [record["media"][0], glass]}, ["slab"], ["opal"], np.array([555.0]))
    >>> told[:50]
    'slab: its finish "opal" scatters light through a f'
    """
    surroundings = index_of(record["media"][0]["index"], wavelength)
    through = np.array([any(map(scatters_through, parts_of(row))) for row in record["finishes"]], bool)
    faces = record["faces"]
    dressed = np.unique(np.stack([faces.solids, faces.finishes], axis=1)[through[faces.finishes]], axis=0)
    for solid, finish in dressed[dressed[:, 0] >= 0].tolist():
        index = index_of(record["media"][record["solids"][solid]["medium"]]["index"], wavelength)
        if (np.abs(index - surroundings) > ALIKE).any():
            ratio = float((index / surroundings).max())
            yield (
                f'{solid_names[solid]}: its finish "{finish_names[finish]}" scatters light through a face between media '
                f"of unlike index by a stated share, which refracts nothing: luminances are wrong by a factor of up to "
                f"{max(ratio, 1 / ratio) ** 2:.3g}; give ground glass a rough-interface, or lay the diffuser on a surface "
                "of its own at a small distance from the solid"
            )


def scatters_through(part: Record) -> bool:
    """Whether a finish that is no sum of others transmits diffusely, or in a lobe, by a stated share.

    Examples
    --------
    >>> from etendue.description.files import Files
    >>> from etendue.scatter.models import Interface, Lambertian, Transmitter
    >>> finishes = Lambertian(reflectance=0, transmittance=1), Transmitter(), Interface()
    >>> [scatters_through(finish.record(Files())) for finish in finishes]
    [True, False, False]
    """
    if part["kind"] == "table":
        return any(one["transmitted"] is not None for side in ("front", "back") for one in part[side])
    if part["kind"] == "scatter":
        return bool(np.any(np.asarray(part["diffuse_transmittance"]["values"]) > 0.0))
    return bool(part.get("transmitted", 0.0))
