"""The table and the function it stands for: values, flux, symmetry, turns."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from etendue.errors import ArgumentError, UnknownNameError
from etendue.quantities.intensity import UNTURNED, Intensity
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.intensity import TERMS, flux_by_quadrature, interpolator, lid

UNEVEN = lid("none", c=[3, 10, 50, 51, 200, 359.5], gamma=[0, 1, 20, 89, 90, 150, 180])


# --- the function ----------------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(c=st.floats(-800, 800), gamma=st.floats(0, 180))
def test_it_is_bilinear_and_periodic(c: float, gamma: float) -> None:
    expected = interpolator(UNEVEN)((c % 360.0, gamma))
    assert UNEVEN.at(c, gamma) == pytest.approx(float(expected), rel=1e-9)


def test_nodes_have_their_values_exactly() -> None:
    assert np.array_equal(UNEVEN.at(UNEVEN.c[:, None], UNEVEN.gamma), UNEVEN.values)
    assert np.array_equal(UNEVEN.at(UNEVEN.c[:, None] + 360.0, UNEVEN.gamma), UNEVEN.values)
    assert np.array_equal(UNEVEN.planes(UNEVEN.c), UNEVEN.values)


def test_it_is_zero_outside_gamma_and_whole_at_its_ends() -> None:
    band = Intensity([0, 180], [30, 90], [[1, 2], [3, 4]])
    assert band.at(90, [29.999, 30, 90, 90.001]).tolist() == [0, 2, 3, 0]
    assert band.at(0, 90 + 1e-10) == 2


def test_directions_follow_the_conventions() -> None:
    """γ from +Z, C from +X towards +Y, whatever the length of the direction."""
    c, gamma = 33.0, 71.0
    a, b = np.radians([c, gamma])
    direction = 7.0 * np.array([np.sin(b) * np.cos(a), np.sin(b) * np.sin(a), np.cos(b)])
    assert UNEVEN.in_direction(direction) == pytest.approx(float(UNEVEN.at(c, gamma)), rel=1e-12)
    quarter = Intensity([0, 90, 180, 270], [0, 90, 180], [[5, 1, 6], [5, 2, 6], [5, 3, 6], [5, 4, 6]])
    axes = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
    assert quarter.in_direction(axes).tolist() == [1, 2, 3, 4, 5, 6]
    assert quarter.in_direction(axes.reshape(2, 3, 3)).shape == (2, 3)


# --- flux ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("symmetry", TERMS)
def test_flux_is_the_integral_of_the_function(symmetry: str) -> None:
    assert lid(symmetry).flux == pytest.approx(flux_by_quadrature(lid(symmetry)), rel=1e-12)


def test_flux_of_uneven_and_partial_tables() -> None:
    for table in (UNEVEN, lid("none", c=[7], gamma=[10, 11, 64]), lid("none", c=[0, 200], gamma=[90, 180])):
        assert table.flux == pytest.approx(flux_by_quadrature(table), rel=1e-12)


def test_flux_in_closed_form() -> None:
    # A constant over the sphere, and a cone of linear fall: ∫(1 - γ/a) sin γ dγ = 1 - sin a / a.
    assert Intensity([0, 100], [0, 180], np.ones((2, 2))).flux == pytest.approx(4 * np.pi, rel=1e-15)
    a = np.radians(25.0)
    assert Intensity([0], [0, 25], [[1, 0]]).flux == pytest.approx(2 * np.pi * (1 - np.sin(a) / a), rel=1e-13)
    fine = Intensity([0], np.linspace(0, 180, 100_001), np.ones((1, 100_001)))
    assert fine.flux == pytest.approx(4 * np.pi, rel=1e-12)


# --- symmetry, maximum -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("symmetry", TERMS)
def test_symmetry_is_found(symmetry: str) -> None:
    assert lid(symmetry).symmetry() == symmetry
    assert lid(symmetry, c=np.arange(0, 360, 0.7 if symmetry == "none" else 1)).symmetry() == symmetry


def test_symmetry_within_a_tolerance() -> None:
    table = lid("both")
    bent = table.values.copy()
    bent[3, 10] += 0.01 * table.maximum
    bent = table.replace(values=bent)
    assert bent.symmetry() == bent.symmetry(0.009) == "none"
    assert bent.symmetry(0.011) == "both"


def test_symmetry_of_the_function_not_of_the_nodes() -> None:
    """A node more on one side, on the straight line between its neighbours, changes no function."""
    table = lid("C0-C180", c=np.arange(0, 360, 20.0))
    c = np.sort(np.append(table.c, 27.0))
    assert Intensity(c, table.gamma, table.planes(c)).symmetry() == "C0-C180"


def test_maximum_and_where_it_is() -> None:
    table = Intensity([10, 200], [0, 45, 180], [[1, 2, 1], [1, 7, 1]])
    assert (table.maximum, table.peak) == (7, (200, 45))
    assert Intensity([10, 200], [0, 45], [[9, 2], [9, 7]]).peak == (0, 0)


# --- turns -----------------------------------------------------------------------------------------------------------


@settings(max_examples=40, deadline=None)
@given(angle=st.floats(-500, 500))
def test_turned_about_the_axis(angle: float) -> None:
    turned = UNEVEN.rotated_about_axis(angle)
    c = np.linspace(0, 350, 36)[:, None]
    assert np.allclose(turned.at(c + angle, [0, 30, 100]), UNEVEN.at(c, [0, 30, 100]), rtol=1e-7)
    assert turned.flux == pytest.approx(UNEVEN.flux, rel=1e-12)


def test_turning_keeps_errors_beside_values_and_facts_in_place() -> None:
    facts = {"opening_shape": "rectangle", "opening_x": 5.0, "opening_y": 2.0, "lamp": "L"}
    table = UNEVEN.replace(standard_error=UNEVEN.values / 7, luminaire=facts)
    turned = table.rotated_about_axis(90)
    assert np.array_equal(turned.standard_error, turned.values / 7)
    assert turned.luminaire == facts | {"opening_x": 2.0, "opening_y": 5.0}
    assert table.rotated_about_axis(-180).luminaire == facts
    assert table.rotated_about_axis(30).luminaire == facts | {"extents_turned": 30}
    assert turned.provenance.steps == ("turned by 90° about the axis",)


@pytest.mark.parametrize("first", [45, 30, -77, 90.0004, 360.0])
def test_turns_of_extents_add_up(first: float) -> None:
    """Two turns are one by their sum, for the opening as for the planes; a whole circle in all changes nothing."""
    heights = (51.0, 1.0, 2.0, 3.0)
    facts = {"opening_shape": "box", "opening_x": 5.0, "opening_y": 2.0, "opening_heights": heights}
    table = UNEVEN.replace(luminaire=facts)
    quarter = table.rotated_about_axis(first).rotated_about_axis(90 - first).luminaire
    assert quarter == facts | {"opening_x": 2.0, "opening_y": 5.0, "opening_heights": (3.0, 51.0, 1.0, 2.0)}
    assert table.rotated_about_axis(first).rotated_about_axis(360 - first).luminaire == facts
    assert table.mirrored().luminaire["opening_heights"] == (51.0, 3.0, 2.0, 1.0)
    mirrored = table.rotated_about_axis(first).mirrored().luminaire
    assert mirrored == table.mirrored().rotated_about_axis(-first).luminaire


def test_what_counts_as_a_quarter_and_what_as_round() -> None:
    box = UNEVEN.replace(luminaire={"opening_shape": "box", "opening_x": 5.0, "opening_y": 5.0})
    assert "extents_turned" not in box.rotated_about_axis(89.9995).luminaire
    assert box.rotated_about_axis(89.99).luminaire["extents_turned"] == pytest.approx(-0.01)
    disk = UNEVEN.replace(luminaire={"opening_shape": "circle", "opening_x": 5.0, "opening_y": 5.0})
    assert disk.rotated_about_axis(45).luminaire == disk.luminaire
    ellipse = UNEVEN.replace(luminaire={"opening_shape": "ellipse", "opening_x": 5.0, "opening_y": 4.0})
    assert ellipse.rotated_about_axis(45).luminaire["extents_turned"] == 45
    housing = {"housing_x": 3.0, "housing_y": 3.0}
    assert "extents_turned" in UNEVEN.replace(luminaire=housing).rotated_about_axis(45).luminaire
    assert (
        "extents_turned"
        not in UNEVEN.replace(luminaire=housing | {"housing_round": True}).rotated_about_axis(45).luminaire
    )


def test_a_lying_cylinder_turns_along() -> None:
    facts = {"opening_shape": "cylinder along length", "opening_x": 5.0, "opening_y": 1.0, "opening_z": 1.0}
    turned = UNEVEN.replace(luminaire=facts).rotated_about_axis(90)
    across = {"opening_shape": "cylinder along width", "opening_x": 1.0, "opening_y": 5.0, "opening_z": 1.0}
    assert turned.luminaire == across
    assert turned.rotated_about_axis(-90).luminaire == facts


def test_nothing_was_turned_is_said_only_where_it_is_true() -> None:
    table = UNEVEN.replace(notes=(f"C is the file's; {UNTURNED}", "something else"))
    assert not table.planes_moved
    assert table.scaled(2).notes == table.notes
    for moved in (table.rotated_about_axis(45), table.mirrored()):
        assert moved.notes == ("something else",)
        assert moved.planes_moved


def test_mirrored() -> None:
    c = np.linspace(0, 350, 36)[:, None]
    assert np.allclose(UNEVEN.mirrored().at(-c, [30, 100]), UNEVEN.at(c, [30, 100]), rtol=1e-12)
    assert np.array_equal(UNEVEN.mirrored().mirrored().values, UNEVEN.values)


def test_scaled() -> None:
    table = UNEVEN.replace(standard_error=UNEVEN.values / 7).scaled(2.5)
    assert table.flux == pytest.approx(2.5 * UNEVEN.flux)
    assert np.allclose(table.standard_error, table.values / 7)


# --- refusals --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"c": [0, 0]}, "rise"),
        ({"c": [0, 360]}, "0 ≤ C < 360"),
        ({"c": [-1, 5]}, "0 ≤ C < 360"),
        ({"c": [[0, 1]]}, "row"),
        ({"c": [0, np.nan]}, "rise"),
        ({"gamma": [0, 181]}, "0 to 180"),
        ({"gamma": [3]}, "at least 2"),
        ({"values": [[1, 2]]}, "shape"),
        ({"values": [[1, 2], [3, np.inf]]}, "not finite"),
        ({"standard_error": [[1, 2]]}, "standard_error"),
    ],
)
def test_tables_that_are_none(changes: dict[str, Any], message: str) -> None:
    whole = {"c": [0, 180], "gamma": [0, 90], "values": [[1, 2], [3, 4]]}
    Intensity(**whole)
    with pytest.raises(ArgumentError, match=message):
        Intensity(**(whole | changes))


def test_unknown_names_and_wrong_questions() -> None:
    with pytest.raises(UnknownNameError, match="'manufacturer'"):
        UNEVEN.replace(luminaire={"manufacturers": "x"})
    with pytest.raises(UnknownNameError, match="flux unit"):
        UNEVEN.replace(flux_unit="mW")
    for call in (
        lambda: UNEVEN.at(0, 181),
        lambda: UNEVEN.at(np.nan, 0),
        lambda: UNEVEN.in_direction([0, 0, 0]),
        lambda: UNEVEN.in_direction([0, 1]),
        lambda: UNEVEN.scaled(-1),
        lambda: UNEVEN.rotated_about_axis(np.inf),
    ):
        with pytest.raises(ArgumentError):
            call()


def test_arrays_cannot_be_changed_from_outside() -> None:
    values = np.ones((2, 2))
    table = Intensity([0, 180], [0, 90], values)
    values[:] = 5
    assert table.maximum == 1
    with pytest.raises(ValueError, match="read-only"):
        table.values[0, 0] = 2
    assert np.isnan(table.standard_error).all()
    assert (table.unit, table.replace(flux_unit="W").quantity) == ("cd", "radiant intensity")
