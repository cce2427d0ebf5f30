"""What a ray set's header says stays true when the set is changed, merged and written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import etendue as et
import numpy as np
import pytest
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.spectrum import photopic_efficiency

LINES = np.array([555.0, 630.0])
EFFICACY = 683.0 * photopic_efficiency(LINES)
"""Of two lines [lm/W]."""


def line(wavelength: float) -> et.Spectrum:
    return et.Spectrum([wavelength], [1.0])


def test_another_spectrum_takes_its_own_lumens_along(tmp_path: Path) -> None:
    """A file states 1 W and the lumens of 555 nm; given another line, it states those of that line, and converts by it."""
    rays = et.RaySet(np.zeros((3, 3)), np.tile([0.0, 0.0, 1.0], (3, 1)), [0.2, 0.3, 0.5], flux_unit="W")
    et.write_rays(tmp_path / "green.tm25ray", rays.with_spectrum(line(LINES[0])))
    green = et.read_rays(tmp_path / "green.tm25ray")
    assert green.header["luminous_flux"] == pytest.approx(EFFICACY[0], rel=1e-6)
    et.write_rays(tmp_path / "red.tm25ray", green.with_spectrum(line(LINES[1])))
    red = et.read_rays(tmp_path / "red.tm25ray")
    assert red.header["luminous_flux"] == pytest.approx(EFFICACY[1], rel=1e-6)
    assert red.in_unit("lm").total_flux == pytest.approx(EFFICACY[1], rel=1e-6)
    # Where no spectrum is known, the two totals of the header are what converts.
    assert red.without_spectrum().in_unit("lm").total_flux == pytest.approx(EFFICACY[1], rel=1e-6)


def labelled(labels: tuple[str, ...], **header: Any) -> et.RaySet:
    """Two rays with two additional columns."""
    records = np.zeros(2, [("position", "<f4", 3), ("direction", "<f4", 3), ("flux", "<f4"), ("additional", "<f4", 2)])
    records["direction"][:, 2], records["flux"], records["additional"] = 1.0, 1.0, [[1, 2], [3, 4]]
    return et.RaySet.from_records(records, RaySetMeaning(header={"additional_labels": labels, **header}))


def test_a_merged_set_says_what_all_its_headers_say(tmp_path: Path) -> None:
    """Words that all agree in, never numbers, which belong to one file: the merged set is measured, by ACME, of no date."""
    both = [
        labelled(("path", "heat"), creation_method="measurement", manufacturer="ACME", date=date, luminous_flux=2.0)
        for date in ("2024", "2025")
    ]
    merged = et.RaySet.merge(both)
    assert merged.header == {
        "additional_labels": ("path", "heat"), "creation_method": "measurement", "manufacturer": "ACME",
    }  # fmt: skip
    notes = et.write_rays(tmp_path / "merged.tm25ray", merged)
    assert not any("measured" in note for note in notes)
    again = et.read_rays(tmp_path / "merged.tm25ray")
    assert (again.header["creation_method"], again.header["manufacturer"]) == ("measurement", "ACME")
    assert again.header["additional_labels"] == ("path", "heat")
    assert again.column("additional").tolist() == [[1, 2], [3, 4]] * 2


def test_columns_under_other_labels_are_not_put_below_each_other() -> None:
    merged = et.RaySet.merge([labelled(("path", "heat")), labelled(("heat", "path"))])
    assert "additional" not in merged.columns
    assert any("left out" in str(told) and "additional" in str(told) for told in merged.complaints)
