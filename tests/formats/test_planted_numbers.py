"""Numbers that no sound ray file holds, at every place where it has one."""

from __future__ import annotations

import tracemalloc
import warnings
from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import FormatError
from etendue.formats.rays import RAY_FORMATS, read_rays, write_rays
from etendue.formats.rays.ray_format import RayFormat
from etendue.quantities.report import RayFileWarning
from oracles.planted_numbers import planted_in_bytes, planted_in_text

BINARY = {"tm25", "etd", "lighttools", "zemax", "speos", "asap"}

MOST_FILES = 150

RAYS = et.RaySet(
    [[1.5, -2, 0.25], [0.5, 3, -1]],
    [[0.6, 0, 0.8], [0, -0.28, 0.96]],
    [0.5, 0.0625],
    flux_unit="W",
    wavelength=[450.0, 610.0],
)


def require_sound_or_refused(path: Path) -> bool:
    """Whether it was read; then every ray that is handed on is one, and an error names file and place."""
    try:
        rays = read_rays(path)
        batches = list(rays.batches())
    except FormatError as error:
        assert str(path) in str(error)  # noqa: PT017 - either outcome is right
        assert error.place  # noqa: PT017
        return False
    for batch in batches:
        assert np.isfinite(batch.position).all()
        assert np.allclose(np.linalg.norm(batch.direction, axis=1), 1.0, rtol=1e-5)
        assert np.isfinite(batch.flux).all()
        assert (batch.flux >= 0.0).all()
    assert np.isfinite(rays.total_flux)
    assert repr(rays)
    return True


@pytest.mark.slow
@pytest.mark.parametrize("ray_format", RAY_FORMATS, ids=lambda f: f.name)
def test_no_planted_number_becomes_a_ray(ray_format: RayFormat, tmp_path: Path) -> None:
    path = tmp_path / "planted"
    write_rays(path, RAYS, ray_format.name)
    data = path.read_bytes()
    assert require_sound_or_refused(path)
    files = planted_in_bytes(data, MOST_FILES) if ray_format.name in BINARY else planted_in_text(data)
    tracemalloc.start()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RayFileWarning)
            for planted in files:
                path.write_bytes(planted)
                require_sound_or_refused(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 32e6
