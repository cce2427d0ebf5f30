"""The sweep over thresholds: its measures by another route, and that the far field does not see what held-out rays do."""

from __future__ import annotations

import csv
import io
import json
import math
import sys
from pathlib import Path

import etendue as et
import numpy as np
import numpy.typing as npt
import pytest
from etendue import _core
from etendue.cli import main
from etendue.errors import ArgumentError, UnknownNameError
from etendue.goniophotometry.comparison import compare_intensities
from etendue.goniophotometry.threshold_sweep import THRESHOLDS, UNIFORM, threshold_sweep
from etendue.lightfield.carrier import Disk, Dome, Plane
from etendue.lightfield.gridded.gridded_source import GriddedSource
from etendue.plot.threshold_picture import plot_threshold_sweep
from etendue.quantities.threshold_sweep import COLUMNS, ThresholdSweep
from oracles.sources import DieUnderDome, PrismaticFilm
from scipy.stats import norm

Array = npt.NDArray[np.float64]
FILM = PrismaticFilm()
DISK = Disk(radius=FILM.radius, centre=FILM.centre)


def film_rays(n: int) -> et.RaySet:
    position, direction = FILM.rays(n, seed=3)
    weight = 0.5 + np.random.default_rng(1).random(n)
    return et.RaySet(position, direction, weight * FILM.total_flux / weight.sum())


@pytest.mark.slow
def test_every_number_by_the_long_way() -> None:
    rays, thresholds = film_rays(40_000), (5.0, 0.5, 0.05)
    sweep = threshold_sweep(rays, DISK, 2.0, thresholds, c_planes=24, gamma_step=5.0, seed=4)
    assert sweep["threshold"].tolist() == list(thresholds)
    assert (sweep.rays, sweep.held_out) == (40_000, int((_core.deal_parts(0, 40_000, 10, 4) == 0).sum()))
    kept = _core.deal_parts(0, 40_000, 10, 4) != 0
    train = et.RaySet(rays.position[kept], rays.direction[kept], rays.flux[kept])
    reference = et.intensity_distribution(rays, 24, 5.0)
    for i, threshold in enumerate(thresholds):
        source = GriddedSource.fit(rays, DISK, 2.0, threshold).as_printed
        assert sweep["bins"][i] == pytest.approx(source.patches.bins.mean())
        assert sweep["unreached"][i] == (source.patches.error > threshold).sum()
        assert sweep["error"][i] == pytest.approx(np.average(source.patches.error, weights=source.patches.flux))
        assert sweep["table_flux"][i] == pytest.approx(source.table_flux / source.total_flux)
        expected = compare_intensities(source.intensity(24, 5.0), reference)
        assert sweep["ncc"][i] == pytest.approx(expected.ncc, rel=1e-9)
        assert sweep["nrmse_thesis"][i] == pytest.approx(expected.nrmse_thesis, rel=1e-9)
        assert sweep["nrmse"][i] == pytest.approx(expected.nrmse, rel=1e-9)
        model = GriddedSource.fit(train, DISK, 2.0, threshold).as_printed
        seen = model.luminance(points=rays.position[~kept], directions=rays.direction[~kept]) * 1e-6 / model.table_flux
        log = np.log((1 - UNIFORM) * seen * (math.pi**2 * FILM.radius**2) + UNIFORM)
        weight = rays.flux[~kept]
        mean = np.average(log, weights=weight)
        assert sweep["score"][i] == pytest.approx(mean, rel=1e-9)
        error = math.sqrt((weight**2 * (log - mean) ** 2).sum()) / weight.sum()
        assert sweep["score_error"][i] == pytest.approx(error, rel=1e-6)


@pytest.mark.slow
def test_the_far_field_rises_while_the_light_field_drowns() -> None:
    """What section 3.2.4 would choose is far worse than a uniform light field, and the score says so."""
    sweep = threshold_sweep(film_rays(200_000), DISK, 1.0)
    by_ncc, by_score = sweep.best("ncc"), sweep.best("score")
    assert sweep["threshold"][by_ncc] <= 0.021
    assert sweep["threshold"][by_score] >= 0.2
    assert sweep["ncc"][by_ncc] > sweep["ncc"][by_score] > 0.95
    assert sweep["score"][by_ncc] < 0 < sweep["score"][by_score]
    assert sweep["score"][by_score] - sweep["score"][by_ncc] > 20 * sweep["score_error"].max()


@pytest.mark.slow
def test_no_score_is_above_that_of_the_truth() -> None:
    """The mean of ln(p) over held-out rays is largest for the true density: by Gibbs, up to noise of 1 in 10⁴."""
    rays = film_rays(60_000)
    sweep = threshold_sweep(rays, DISK, 2.0, (5.0, 1.0, 0.2))
    lots = _core.deal_parts(0, 60_000, 10, 1) == 0
    truth = FILM.luminance(points=rays.position[lots], directions=rays.direction[lots]) * 1e-6 / FILM.total_flux
    # The rays are those of the film with weights that know nothing of it.
    best = np.average(np.log(truth * math.pi**2 * FILM.radius**2), weights=rays.flux[lots])
    assert (sweep["score"] < best + norm.isf(1e-4) * sweep["score_error"]).all()
    assert sweep["score"].max() > 0


def test_domes_have_a_sweep_too() -> None:
    truth = DieUnderDome(floor=0.05)
    position, direction = truth.rays(12_000, seed=2)
    seen: list[int] = []
    sweep = threshold_sweep(
        et.RaySet(position, direction, np.full(12_000, truth.total_flux / 12_000)),
        Dome(radius=1.264, window=0.9), 0.2, (5.0, 1.0), 5, c_planes=12, gamma_step=10.0, progress=seen.append,
    )  # fmt: skip
    assert sweep.patches > 100
    assert (sweep["score"] > 1).all()
    assert seen == sorted(seen)
    assert seen[-1] == 12_000


@pytest.mark.parametrize(
    ("change", "hint"),
    [
        ({"thresholds": ()}, "at least one"),
        ({"thresholds": (1.0, -1.0)}, "percent"),
        ({"c_planes": 0}, "c_planes"),
        ({"gamma_step": 7.0}, "divide"),
        ({"surface": Disk(radius=1, centre=(99, 99))}, "no light crosses"),
        ({"seed": 2**64}, "seed"),
    ],
)
def test_refusals(change: dict[str, object], hint: str) -> None:
    arguments: dict[str, object] = {"surface": DISK} | change
    with pytest.raises(ArgumentError, match=hint):
        threshold_sweep(film_rays(300), **arguments)  # type: ignore[arg-type]


def test_too_few_rays_to_judge() -> None:
    rays = et.RaySet([[0, 0, 0]] * 3, [[0, 0, 1]] * 3, [1.0] * 3)
    seed = next(s for s in range(100) if (_core.deal_parts(0, 3, 10, s) != 0).all())
    with pytest.raises(ArgumentError, match="too few"):
        threshold_sweep(rays, Plane(0, 1, 1, (0, 0)), seed=seed)


# --- the table and its picture -------------------------------------------------------------------------------------------


def sweep_of(**columns: list[float]) -> ThresholdSweep:
    n = len(columns["threshold"])
    return ThresholdSweep({name: np.full(n, 0.5) for name in COLUMNS} | columns, patches=4, rays=90, held_out=9)  # type: ignore[arg-type]


def test_the_table() -> None:
    sweep = sweep_of(threshold=[5.0, 1.0, 0.1], score=[0.1, 0.3, 0.3], ncc=[0.9, 0.95, 0.99], nrmse=[3.0, 2.0, 2.5])
    assert [sweep.best(name) for name in ("score", "ncc", "nrmse")] == [1, 2, 1]
    rows = list(csv.DictReader(io.StringIO(sweep.to_csv())))
    assert list(rows[0]) == list(COLUMNS)
    assert [float(row["ncc"]) for row in rows] == [0.9, 0.95, 0.99]
    assert json.loads(json.dumps(sweep.to_dict()))["rows"][2]["threshold"] == 0.1
    with pytest.raises(ArgumentError, match="one length"):
        sweep_of(threshold=[5.0, 1.0], score=[0.1])
    with pytest.raises(ArgumentError, match="one row each"):
        ThresholdSweep({"threshold": np.ones(2)}, patches=1, rays=2, held_out=1)
    with pytest.raises(ValueError, match="read-only"):
        sweep["ncc"][0] = 1


@pytest.mark.slow
def test_the_picture(tmp_path: Path) -> None:
    sweep = sweep_of(threshold=[0.1, 5.0, 1.0], score=[-0.1, 0.3, 0.2], ncc=[0.99, 0.9, 0.95], bins=[12_345.0, 20, 100])
    figure = plot_threshold_sweep(sweep, tmp_path / "a.png")
    plot_threshold_sweep(sweep, tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    far_field, other, score = figure.axes
    assert far_field.lines[0].get_ydata().tolist() == [99, 90, 95]
    assert other.lines[0].get_ydata().tolist() == [50, 50, 50]
    assert score.lines[0].get_ydata().tolist() == [-0.1, 0.3, 0.2]
    left, right = score.get_xlim()
    assert left > 5.0
    assert right < 0.1
    marks = {text.get_text() for text in score.texts}
    assert marks == {"best NCC", "best score"}
    same = sweep_of(threshold=[5.0, 1.0], score=[0.1, 0.2], ncc=[0.9, 0.95])
    assert {text.get_text() for text in plot_threshold_sweep(same).axes[2].texts} == {"best NCC and score"}
    many = sweep_of(threshold=(np.arange(1, 32) / 10).tolist())
    assert len(plot_threshold_sweep(many).axes[2].get_xticks()) <= 10
    for bad in ([1.0], [1.0, 0.0]):
        with pytest.raises(ArgumentError, match="two or more"):
            plot_threshold_sweep(sweep_of(threshold=bad))
    with pytest.raises(UnknownNameError):
        plot_threshold_sweep(sweep, tmp_path / "a.bmp")


@pytest.mark.slow
def test_the_verb(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    et.write_rays("film.tm25ray", film_rays(20_000))
    for options in (["--json"], []):
        arguments = ["film.tm25ray", "--surface", DISK.spec, "--pixel", "4", "--threshold", "3", "--sweep", "-o", "p"]
        monkeypatch.setattr(sys, "argv", ["etendue", "patches", *arguments, *options])
        with pytest.raises(SystemExit) as leaving:
            main()
        assert not leaving.value.code
        out = capsys.readouterr().out
        if options:
            rows = json.loads(out)["sweep"]["rows"]
            assert [row["threshold"] for row in rows] == sorted({*THRESHOLDS, 3.0}, reverse=True)
            text = (tmp_path / "p" / "sweep.csv").read_text("utf-8")
            assert [float(row["score"]) for row in csv.DictReader(io.StringIO(text))] == [row["score"] for row in rows]
        else:
            assert "threshold by rays kept back: " in out
        assert (tmp_path / "p" / "sweep.png").stat().st_size > 5000
