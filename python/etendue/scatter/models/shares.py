"""Surfaces of stated shares, mirrored, straight on and Lambertian. What is left over is absorbed."""

from __future__ import annotations

import abc
from typing import Literal

import numpy as np
from pydantic import Field

from etendue.description.files import Files
from etendue.description.tables import Grid, Shares, constant, grid_of, on_common_nodes
from etendue.errors import ArgumentError
from etendue.scatter.models.finish import Finish, Record

PARTS = ("specular_reflectance", "specular_transmittance", "diffuse_reflectance", "diffuse_transmittance")
"""The four ways of light away from a surface, as the core names them."""

ROUNDING = 1e-9
"""By which shares may exceed 1: numbers that were added up in decimals."""


class Scattering(Finish, abc.ABC):
    """What finishes with given shares have in common."""

    @abc.abstractmethod
    def shares(self, files: Files) -> dict[str, Grid]:
        """The shares of light, by names of `PARTS`; those left out are 0."""

    def record(self, files: Files) -> Record:
        """The four shares, each on its own nodes."""
        shares = self.shares(files)
        angle, wavelength, values = on_common_nodes(list(shares.values()))
        total = sum(values, np.zeros((angle.size, wavelength.size)))
        if total.max() > 1.0 + ROUNDING:
            i, j = np.unravel_index(np.argmax(total), total.shape)
            raise ArgumentError(
                f"the shares add up to {total.max():.6g} at {angle[i]:g}° and {wavelength[j]:g} nm; no more than 1 can leave"
            )
        return {"kind": "scatter", **{part: shares.get(part, constant(0.0)).record() for part in PARTS}}


class Mirror(Scattering):
    """Specular reflection.

    Parameters
    ----------
    reflectance : number or ShareTable

    Examples
    --------
    >>> Mirror(reflectance=0.95).record(Files())["specular_reflectance"]["values"].tolist()
    [[0.95]]
    """

    kind: Literal["mirror"] = "mirror"
    stated_reflectance: Shares = Field(default=1.0, alias="reflectance")

    def shares(self, files: Files) -> dict[str, Grid]:
        """The specular reflectance."""
        return {"specular_reflectance": grid_of(self.stated_reflectance, files)}


class Absorber(Scattering):
    """Absorbs everything.

    Examples
    --------
    >>> Absorber().record(Files())["diffuse_reflectance"]["values"].tolist()
    [[0.0]]
    """

    kind: Literal["absorber"] = "absorber"

    def shares(self, files: Files) -> dict[str, Grid]:  # noqa: ARG002 - nothing comes from files
        """Nothing."""
        return {"diffuse_reflectance": constant(0.0)}


class Lambertian(Scattering):
    """Diffuse reflection and transmission with the same luminance in all directions, thesis eq. 4.1.

    Parameters
    ----------
    reflectance : number or ShareTable
    transmittance : number or ShareTable

    Examples
    --------
    >>> Lambertian(reflectance=0.984).record(Files())["diffuse_reflectance"]["values"].tolist()
    [[0.984]]
    """

    kind: Literal["lambertian"] = "lambertian"
    stated_reflectance: Shares = Field(alias="reflectance")
    stated_transmittance: Shares = Field(default=0.0, alias="transmittance")

    def shares(self, files: Files) -> dict[str, Grid]:
        """Diffuse reflectance and transmittance."""
        return {
            "diffuse_reflectance": grid_of(self.stated_reflectance, files),
            "diffuse_transmittance": grid_of(self.stated_transmittance, files),
        }

    def lets_light_in(self, files: Files) -> bool:  # noqa: ARG002 - a file may be needed to know
        """If it transmits."""
        return self.stated_transmittance != 0.0


class DiffuseSpecular(Scattering):
    """Specular reflection R_spec(θ), and Lambertian reflection of the rest of R_total, thesis eq. 4.2.

    Parameters
    ----------
    total_reflectance : number or ShareTable
        R_total.
    specular_reflectance : number or ShareTable
        R_spec, nowhere more than R_total.

    Examples
    --------
    >>> paint = DiffuseSpecular(
    ...     total_reflectance=0.9, specular_reflectance={"angle": [0, 90], "values": [0.05, 0.85]})
    >>> paint.record(Files())["diffuse_reflectance"]["values"].round(12).ravel().tolist()
    [0.85, 0.05]
    """

    kind: Literal["diffuse-specular"] = "diffuse-specular"
    total_reflectance: Shares
    specular_reflectance: Shares

    def shares(self, files: Files) -> dict[str, Grid]:
        """Specular reflectance, and the diffuse one on the nodes of both."""
        grids = [grid_of(self.total_reflectance, files), grid_of(self.specular_reflectance, files)]
        angle, wavelength, (total, specular) = on_common_nodes(grids)
        diffuse = total - specular
        if diffuse.min() < -ROUNDING:
            i, j = np.unravel_index(np.argmin(diffuse), diffuse.shape)
            raise ArgumentError(
                f"specular_reflectance {specular[i, j]:g} is more than total_reflectance {total[i, j]:g} "
                f"at {angle[i]:g}° and {wavelength[j]:g} nm"
            )
        return {
            "specular_reflectance": Grid(angle, wavelength, specular),
            "diffuse_reflectance": Grid(angle, wavelength, np.maximum(diffuse, 0.0)),
        }


class Transmitter(Scattering):
    """Light passes without Fresnel's reflection: an ideal transmitting surface.

    It goes straight on. On a face between media of unlike index it is refracted by Snell's law; beyond the critical angle
    the share that would be transmitted is mirrored.

    Parameters
    ----------
    transmittance : number or ShareTable

    Examples
    --------
    >>> Transmitter(transmittance=0.5).record(Files())["specular_transmittance"]["values"].tolist()
    [[0.5]]
    """

    kind: Literal["transmitter"] = "transmitter"
    stated_transmittance: Shares = Field(default=1.0, alias="transmittance")

    def shares(self, files: Files) -> dict[str, Grid]:
        """The specular transmittance."""
        return {"specular_transmittance": grid_of(self.stated_transmittance, files)}

    def lets_light_in(self, files: Files) -> bool:  # noqa: ARG002 - a file may be needed to know
        """If it transmits."""
        return self.stated_transmittance != 0.0


class Mixed(Scattering):
    """Any mixture of specular and Lambertian reflection and transmission; specular transmission is that of `Transmitter`.

    Parameters
    ----------
    specular_reflectance, specular_transmittance, diffuse_reflectance, diffuse_transmittance : number or ShareTable

    Examples
    --------
    >>> sorted(Mixed(diffuse_reflectance=0.4, diffuse_transmittance=0.5).shares(Files())) == sorted(PARTS)
    True
    """

    kind: Literal["mixed"] = "mixed"
    specular_reflectance: Shares = 0.0
    specular_transmittance: Shares = 0.0
    diffuse_reflectance: Shares = 0.0
    diffuse_transmittance: Shares = 0.0

    def shares(self, files: Files) -> dict[str, Grid]:
        """All four."""
        return {part: grid_of(getattr(self, part), files) for part in PARTS}

    def lets_light_in(self, files: Files) -> bool:  # noqa: ARG002 - a file may be needed to know
        """If it transmits in either way."""
        return self.specular_transmittance != 0.0 or self.diffuse_transmittance != 0.0
