"""Pictures of sweeps: the lines and bands are the table's, and what cannot be drawn is told."""

from __future__ import annotations

from pathlib import Path

import etendue as et
import numpy as np
import pytest

PLACE = np.array([7.0, 5.0, 6.0])


def table(parameters: int = 1, done: int | None = None) -> et.SweepTable:
    axes = {"lens.at.2": PLACE, "die.flux": [50.0, 100.0], "die.spin": [0.0]}
    axes = dict(list(axes.items())[:parameters])
    shape = tuple(len(values) for values in axes.values())
    size = int(np.prod(shape))
    grow = np.arange(1.0, size + 1.0)
    grow[done if done is not None else size :] = np.nan
    values = {"escaped": grow, "flux:desk": 2 * grow, "peak:far": 1e9 * grow, "efficiency": grow / size}
    values = {name: array.reshape(shape) for name, array in values.items()}
    units = {"lens.at.2": "mm", "die.flux": "lm", "escaped": "lm", "flux:desk": "lm", "peak:far": "cd"}
    errors = {name: array / 8 for name, array in values.items()}
    return et.SweepTable(axes, values, errors, units, size if done is None else done)


def test_one_parameter_has_a_diagram_for_each_unit_with_its_lines_and_bands() -> None:
    swept = table()
    figure = et.plot_sweep(swept)
    flux, peak, share = figure.axes
    order = np.argsort(PLACE)
    for axes, names in ((flux, ("escaped", "flux:desk")), (peak, ("peak:far",)), (share, ("efficiency",))):
        for line, band, name in zip(axes.lines, axes.collections, names, strict=True):
            np.testing.assert_array_equal(line.get_xdata(), PLACE[order])
            np.testing.assert_array_equal(line.get_ydata(), swept[name][order])
            edges = band.get_paths()[0].vertices[:, 1]
            error = swept.standard_error[name]
            assert (edges.min(), edges.max()) == pytest.approx((min(swept[name] - error), max(swept[name] + error)))
    assert flux.get_ylabel() == "flux [lm]"
    assert peak.get_ylabel() == "peak:far [10⁹ cd]"
    assert share.get_ylabel() == "efficiency"
    assert share.get_xlabel() == "lens.at.2 [mm]"


def test_two_parameters_have_a_line_for_each_value_of_the_second() -> None:
    swept = table(2)
    figure = et.plot_sweep(swept)
    assert len(figure.axes) == 4
    for axes, name in zip(figure.axes, swept.values, strict=True):
        for i, line in enumerate(axes.lines):
            np.testing.assert_array_equal(line.get_ydata(), swept[name][np.argsort(PLACE), i])
            assert line.get_label() == f"die.flux = {(50, 100)[i]} lm"


def test_steps_to_come_leave_a_gap(tmp_path: Path) -> None:
    figure = et.plot_sweep(table(done=2), tmp_path / "a.png")
    assert np.isnan(figure.axes[0].lines[0].get_ydata()).sum() == 1
    et.plot_sweep(table(done=2), tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_what_cannot_be_drawn_is_told() -> None:
    with pytest.raises(et.ArgumentError, match="one or two parameters"):
        et.plot_sweep(table(3))
    with pytest.raises(et.ArgumentError, match="no step is done"):
        et.plot_sweep(table(done=0))
    many = et.SweepTable({"a": [1.0], "b": np.arange(13.0)}, {"m": np.ones((1, 13))}, {"m": np.ones((1, 13))}, {}, 13)
    with pytest.raises(et.ArgumentError, match="13 lines"):
        et.plot_sweep(many)
