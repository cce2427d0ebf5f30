"""`BsdfData`: a BSDF as a file holds it, in slices of one incidence each and in components described by models."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from etendue.quantities.bsdf_slice import BsdfSlice
from etendue.quantities.provenance import Provenance
from etendue.quantities.report import Complaint


@dataclasses.dataclass(frozen=True, eq=False)
class BsdfData:
    """A BSDF as a file holds it: slices, and components that are described by a model.

    Parameters
    ----------
    slices : sequence of BsdfSlice
        In any order.
    components : sequence of dict
        What a file describes by a model, in the keys of a scene's finishes: ``{"kind": "abg", "a": 0.1, …}``. Components and
        slices add up.
    isotropic : bool
        Whether turning the sample about its normal changes nothing: each slice then stands for all azimuths of incidence.
    mirrored : bool
        Whether the sample is its own mirror image in each plane of incidence.
    both_sides : bool
        Whether light that meets the back is treated as light that meets the front (nothing else is said about it).
    name, provenance, complaints, facts
        What the file calls it, where it comes from, what was not as it should be, and what else it says (text by name).
    format : str
        The format of the file that it was read from, by its name in the registry of formats; empty: of no file.

    Examples
    --------
    >>> BsdfData(components=({"kind": "lambertian", "reflectance": 0.5},), name="paint").wavelengths
    ()
    """

    slices: tuple[BsdfSlice, ...] = ()
    components: tuple[Mapping[str, Any], ...] = ()
    _: dataclasses.KW_ONLY
    isotropic: bool = True
    mirrored: bool = True
    both_sides: bool = True
    name: str = ""
    provenance: Provenance | None = None
    complaints: tuple[Complaint, ...] = ()
    facts: Mapping[str, str] = dataclasses.field(default_factory=dict)
    format: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "slices", tuple(self.slices))
        object.__setattr__(self, "components", tuple(self.components))
        object.__setattr__(self, "complaints", tuple(self.complaints))

    @property
    def wavelengths(self) -> tuple[float, ...]:
        """All that are stated [nm], in order."""
        return tuple(sorted({one.wavelength for one in self.slices if one.wavelength is not None}))
