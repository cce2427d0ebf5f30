"""The verb that shows and clears the light fields that are kept."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import pytest
from etendue.lightfield.fit_cache import FOLDER_VARIABLE

from cli.outcome import Run


@pytest.mark.slow
def test_fields_are_kept_shown_and_cleared(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "kept"))
    et.write_rays(tmp_path / "led.tm25ray", et.RingSource(rays=3000))
    look = ("luminance", "led.tm25ray", "--observer", "0,0", "--size", "70,70", "--pixels", "4,4")
    look = (*look, "--surface", "disk:radius=40", "-o", "map.npz")  # to choose one takes seconds
    assert run(*look, "--no-cache").status == 0
    assert run("cache", "--json").json["fields"] == 0
    assert run(*look).status == 0
    assert run("cache", "--json").json["fields"] == 1
    assert "1 light fields" in run("cache").out
    assert "removed" in run("cache", "--clear").out
    assert run("cache", "--json").json["fields"] == 0
    monkeypatch.setenv(FOLDER_VARIABLE, "")
    assert "no light fields are kept" in run("cache").out


@pytest.mark.slow
def test_a_report_has_the_field_that_maps_have(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "kept"))
    et.write_rays(tmp_path / "led.tm25ray", et.RingSource(rays=3000))
    surface = ("--surface", "disk:radius=40")  # to choose one takes seconds
    look = ("luminance", "led.tm25ray", "--observer", "0,0", "--size", "70,70", "--pixels", "4,4", *surface)
    assert run(*look, "-o", "map.npz").status == 0
    # The pages that are drawn, for a second each, are tried elsewhere.
    monkeypatch.setattr("etendue.cli.report.plot_report", lambda *_: None)
    fits = []
    fit = et.LightField.fit
    monkeypatch.setattr(et.LightField, "fit", staticmethod(lambda *a, **k: fits.append(1) or fit(*a, **k)))
    report = ("report", "led.tm25ray", "--no-forecast", "-o", "page.html", *surface)
    for more, times in (((), 0), (("--no-cache",), 1), (("--seed", "2"), 2), (("--seed", "2"), 2)):
        assert run(*report, *more).status == 0
        assert len(fits) == times
