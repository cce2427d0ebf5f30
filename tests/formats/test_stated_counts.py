"""Numbers of rays that a text states and no machine can count."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import numpy as np
import pytest
from etendue.errors import FormatError


@pytest.mark.parametrize(("name", "old"), [("rays.csv", "# rays: 3"), ("rays.txt", None)])
def test_a_count_of_thousands_of_digits(name: str, old: str | None, tmp_path: Path) -> None:
    """No such count, or a refusal; never an error of Python's own conversion."""
    path = tmp_path / name
    if old is None:
        path.write_text("9" * 6000 + "\n1 1.5 -2 3 0 0.6 0.8 450 0.25\n")
    else:
        direction = np.tile([0.0, 0.6, 0.8], (3, 1))
        et.write_rays(path, et.RaySet(np.arange(9.0).reshape(3, 3), direction, np.ones(3), flux_unit="lm"))
        text = path.read_text()
        assert text.count(old) == 1
        path.write_text(text.replace(old, "# rays: " + "9" * 6000))
    try:
        rays = et.read_rays(path)
    except FormatError:
        return
    assert rays.total_flux == pytest.approx(3 if old else 0.25)
