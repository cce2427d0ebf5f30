"""Rough surfaces of small facets: metals, transparent interfaces, coats over a diffuse base."""

from __future__ import annotations

import abc
from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le
from pydantic import Field

from etendue.description.files import Files
from etendue.description.tables import Shares, grid_of
from etendue.description.values import AsNumber, Finite
from etendue.errors import ArgumentError
from etendue.scatter.models.finish import Directed, Record

Roughness = Annotated[float, Finite, Ge(1e-3), Le(2.0), AsNumber]


class Rough(Directed, abc.ABC):
    """What surfaces of facets have in common.

    The slopes of the facets have the distribution of Trowbridge and Reitz (GGX), with long tails, or of Beckmann, which is
    normal with standard deviations α/√2 [Walter2007]_. Facets hide each other after Smith, with heights correlated
    [Heitz2014]_. Light that would meet more than one facet is not lost: it leaves in a broad lobe so that energy and
    reciprocity are kept [Kulla2017]_.
    """

    roughness: Roughness
    roughness_across: Roughness | None = None
    distribution: Literal["ggx", "beckmann"] = "ggx"

    @abc.abstractmethod
    def parameters(self, files: Files) -> Record:
        """What the core takes beside the facets."""

    def record(self, files: Files) -> Record:
        """The facets, and what they are made of."""
        across = self.roughness if self.roughness_across is None else self.roughness_across
        return {
            "kind": self.kind,  # type: ignore[attr-defined] # each class has one
            "alpha_x": self.roughness,
            "alpha_y": across,
            "ggx": float(self.distribution == "ggx"),
            **self.parameters(files),
        }


class RoughMetal(Rough):
    """A rough metal: each facet reflects what a smooth surface would.

    Parameters
    ----------
    roughness : number
        α of the facets, from 0.001 (a mirror) to 2: the slope √⟨tan²θ⟩ of Beckmann's facets.
    roughness_across : number, optional
        That across `axis`; the same if left out. A surface that is brushed along the axis is rougher across it.
    distribution : {"ggx", "beckmann"}
        Of the slopes.
    axis : three numbers
        Of the brushing, in the coordinates of the solid or surface; it is laid on the surface at every point.
    reflectance : number or ShareTable
        Of the smooth metal, by angle of incidence and wavelength.
    index, extinction : number, optional
        In place of `reflectance`: the refractive index n and the extinction coefficient k of the metal. What it reflects
        depends, by Fresnel's equations, on the medium in which light arrives.

    Examples
    --------
    >>> aluminium = RoughMetal(roughness=0.2, index=0.96, extinction=6.69)
    >>> aluminium.reflectance([0, 60]).round(3).tolist()
    [0.916, 0.9]
    """

    kind: Literal["rough-metal"] = "rough-metal"
    stated_reflectance: Shares | None = Field(default=None, alias="reflectance")
    index: Annotated[float, Finite, Gt(0.0), Le(100.0), AsNumber] | None = None
    extinction: Annotated[float, Finite, Ge(0.0), Le(100.0), AsNumber] | None = None

    def parameters(self, files: Files) -> Record:
        """The reflectance, or the index of the metal."""
        if self.stated_reflectance is not None:
            if self.index is not None or self.extinction is not None:
                raise ArgumentError("RoughMetal takes reflectance, or index and extinction; not both")
            return {"reflectance": grid_of(self.stated_reflectance, files).record()}
        if self.index is None or self.extinction is None:
            raise ArgumentError("RoughMetal needs reflectance, or index and extinction")
        return {"index": self.index, "extinction": self.extinction}


class RoughInterface(Rough):
    """A rough interface of the media on both sides: ground or etched glass. Nothing is lost.

    What meets more than one facet leaves to both sides, in proportion to n² as if it had met many.

    Parameters
    ----------
    roughness, roughness_across, distribution, axis
        As of `RoughMetal`.

    Examples
    --------
    >>> ground = RoughInterface(roughness=0.4)
    >>> glass = ground.reflectance(0, media=(1.0, 1.5)), ground.transmittance(0, media=(1.0, 1.5))
    >>> [round(float(share), 3) for share in glass]
    [0.034, 0.966]
    """

    kind: Literal["rough-interface"] = "rough-interface"

    def parameters(self, files: Files) -> Record:  # noqa: ARG002 - the media are those of the scene
        """Nothing more."""
        return {}

    def lets_light_in(self, files: Files) -> bool:  # noqa: ARG002 - it always does
        """It does."""
        return True


class RoughCoat(Rough):
    """A rough clear coat on a Lambertian base: satin or matt paint.

    One facet of the coat reflects, or lets light in; of that the base sends back the share ρ again and again, as under a
    smooth coat [Saunderson1942]_.

    Parameters
    ----------
    roughness, roughness_across, distribution, axis
        As of `RoughMetal`.
    index : number
        Refractive index of the coat, more than 1.
    base_reflectance : number or ShareTable
        ρ of the base within the coat; the same at all angles.

    Examples
    --------
    >>> satin = RoughCoat(roughness=0.25, index=1.5, base_reflectance=0.9)
    >>> satin.reflectance([0, 60]).round(3).tolist()
    [0.798, 0.804]
    """

    kind: Literal["rough-coat"] = "rough-coat"
    index: Annotated[float, Finite, Gt(1.0), Le(10.0), AsNumber]
    base_reflectance: Shares

    def parameters(self, files: Files) -> Record:
        """The index, and the reflectance by wavelength."""
        base = grid_of(self.base_reflectance, files)
        if (base.values != base.values[0]).any():
            raise ArgumentError(
                "base_reflectance depends on the angle of incidence; within a coat light comes from all"
            )
        return {"index": self.index, "base_reflectance": base.record()}
