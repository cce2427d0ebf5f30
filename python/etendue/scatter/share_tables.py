"""A BSDF as shares of mirrored, Lambertian and Gaussian light, for formats that hold no tables."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

from etendue.description.files import Files
from etendue.description.tables import constant, on_common_nodes
from etendue.errors import ArgumentError
from etendue.formats.bsdf.bsdf_format import BsdfFormat, ShareTables
from etendue.formats.bsdf.speos_shares import lobe_of
from etendue.quantities.bsdf_data import BsdfData
from etendue.scatter.bsdf import Bsdf
from etendue.scatter.models import MODELS
from etendue.scatter.models.shares import PARTS, Scattering
from etendue.scatter.table import BsdfTable

Array = npt.NDArray[np.float64]
Place = tuple[bool, float, float | None]
"""Whether light is transmitted, its angle of incidence [°] and its wavelength [nm]."""

DIGITS = 9
"""Of angles of incidence [°], which went through directions."""


def share_tables(bsdf: Bsdf, form: BsdfFormat) -> ShareTables:
    """A BSDF that has neither tables nor lobes, but for those that Speos describes by their share and width.

    Parameters
    ----------
    bsdf : Bsdf
        A model of shares, or what was read from a file of them.
    form : BsdfFormat
        For errors.

    Raises
    ------
    ArgumentError
        If it is more than that.

    Examples
    --------
    >>> from etendue.formats.bsdf import BSDF_FORMATS
    >>> from etendue.scatter.models import Mirror
    >>> share_tables(Mirror(reflectance=0.9), BSDF_FORMATS["speos-coated"]).specular.ravel().tolist()
    [0.9, 0.0]
    """
    plain, name = bsdf, type(bsdf).__name__
    lobes: dict[Place, tuple[float, float, float]] | None = {}
    if isinstance(bsdf, BsdfTable) and len(bsdf.data.components) <= 1:
        component = dict(bsdf.data.components[0]) if bsdf.data.components else {"kind": "absorber"}
        plain, name, lobes = MODELS[component["kind"]](**component), bsdf.name, _lobes(bsdf.data)
    if isinstance(plain, Scattering) and lobes is not None:
        shares = plain.shares(Files())
        angle, wavelength, values = on_common_nodes([shares.get(part, constant(0.0)) for part in PARTS])
        there = dict(zip(PARTS, values, strict=True))
        specular, diffuse = (
            np.array([there[f"{part}_{way}"] for way in ("reflectance", "transmittance")])
            for part in ("specular", "diffuse")
        )
        found = ShareTables(name, angle, wavelength, specular, diffuse)
        together = _with_lobes(found, lobes) if lobes else found
        if together is not None:
            return together
    raise ArgumentError(
        f"{form.title} holds shares of mirrored and Lambertian light, and this BSDF is more than that: write a table of "
        "it, as .anisotropicbsdf or .brdf"
    )


def _lobes(data: BsdfData) -> dict[Place, tuple[float, float, float]] | None:
    """Share and widths of each slice; None if one of them is no such lobe, or the sample is not alike all around."""
    found: dict[Place, tuple[float, float, float]] = {}
    for one in data.slices:
        lobe = lobe_of(one)
        if lobe is None:
            return None
        found[one.transmitted, round(one.theta, DIGITS), one.wavelength] = lobe
    alike = data.isotropic and data.both_sides
    return found if alike and len(found) == len(data.slices) else None


def _with_lobes(shares: ShareTables, lobes: dict[Place, tuple[float, float, float]]) -> ShareTables | None:
    """Shares at the angles and wavelengths of lobes; None if they have kinks in between, or a lobe is missing there."""
    thetas = np.unique([theta for _, theta, _ in lobes])
    angle = np.unique([0.0, *thetas, 0.5 * 180.0])
    waves = sorted({wave for _, _, wave in lobes if wave is not None})
    wavelength = np.array(waves) if waves else shares.wavelength
    kinks = shares.angle if shares.angle.size > 1 else angle[:1]
    colours = shares.wavelength if shares.wavelength.size > 1 else wavelength[:1]
    if not np.isin(np.round(kinks, DIGITS), angle).all() or not np.isin(colours, wavelength).all():
        return None

    def at(values: Array) -> Array:
        by_angle = [np.stack([np.interp(angle, shares.angle, each) for each in way.T], axis=1) for way in values]
        return np.array([[np.interp(wavelength, shares.wavelength, row) for row in way] for way in by_angle])

    specular, diffuse = at(shares.specular), at(shares.diffuse)
    lobe, width = np.zeros_like(specular), np.zeros((2, *specular.shape))
    for transmitted in {way for way, _, _ in lobes}:
        for (i, theta), (j, wave) in itertools.product(enumerate(angle), enumerate(wavelength)):
            # Below the first and beyond the last lobe nothing changes, as long as there is light for it.
            near = float(np.clip(theta, thetas[0], thetas[-1]))
            known = lobes.get((transmitted, near, float(wave)), lobes.get((transmitted, near, None)))
            if known is None:
                return None
            lobe[int(transmitted), i, j], width[0, int(transmitted), i, j], width[1, int(transmitted), i, j] = known
    left = np.maximum(1.0 - (specular + diffuse).sum(axis=0), 0.0)
    beyond = angle > thetas[-1]
    lobe[:, beyond] *= np.minimum(1.0, left / np.maximum(lobe.sum(axis=0), np.finfo(np.float64).tiny))[beyond]
    return ShareTables(shares.name, angle, wavelength, specular, diffuse, lobe, width)
