"""A BSDF without symmetry, of which a writer may make tables, and what keeps these small."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

Array = npt.NDArray[np.float64]


class Slanted:
    """A BSDF without symmetry: a lobe beside the specular direction, on another side of it for each incidence."""

    name, isotropic, reflects, transmits, both_sides = "slanted & co", False, True, True, False
    wavelengths: tuple[float, ...] = ()
    incidences = (5.0, 60.0)
    turns = (0.0, 100.0, 200.0, 300.0)  # no azimuth is the mirror image of another one

    def evaluate(self, incident: npt.ArrayLike, scattered: npt.ArrayLike, *, wavelength: float | None = None) -> Array:
        assert wavelength is None
        i, s = np.broadcast_arrays(np.asarray(incident, float), np.asarray(scattered, float))
        back = (i[..., 2] > 0) == (s[..., 2] > 0)
        off = s[..., :2] + i[..., :2] - 0.1 * np.stack([1.0 + i[..., 1], i[..., 0]], axis=-1)
        lobe = 0.4 * np.exp(-0.5 * np.sum(off * off, axis=-1) / 0.3**2) * (1.0 + 0.4 * s[..., 1] + 0.2 * i[..., 0])
        return np.asarray(np.where(back, lobe, 0.5 * lobe) * np.where(i[..., 2] > 0, 1.0, 0.7))


class SlantedOnce(Slanted):
    """The same at one angle of incidence, for what looks at bytes and not at angles."""

    incidences = (60.0,)


def coarsen(patch: pytest.MonkeyPatch, step: float = 15.0) -> None:
    """Tables with fewer azimuths, at steps in degrees: text of all of them takes seconds to write and to read."""
    for name in ("astm", "bird", "fred", "lighttools", "speos"):
        patch.setattr(f"etendue.formats.bsdf.{name}.PHI_STEP", step)
    for name in ("ssdd", "tracepro"):
        patch.setattr(f"etendue.formats.bsdf.{name}.AZIMUTH_STEP", step)
