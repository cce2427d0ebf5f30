"""Ray sets over arrays, records and mapped files: what they hold, what they refuse, and what they complain about."""

from __future__ import annotations

import dataclasses
import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from etendue.errors import ArgumentError, UnknownNameError
from etendue.quantities.provenance import Provenance
from etendue.quantities.ray_records import RaySetMeaning
from etendue.quantities.ray_set import RaySet
from etendue.quantities.report import Complaint, RayFileWarning
from etendue.quantities.spectrum import Spectrum
from hypothesis import given, settings
from hypothesis import strategies as st

N = 257
FILE = Provenance(source="led.ray", format="lighttools")


def values(n: int = N) -> dict[str, np.ndarray]:
    """Columns without symmetry, exact in binary32; directions are not of unit length."""
    rng = np.random.default_rng(11)
    columns = {
        "position": rng.normal([1, -2, 0.25], [2, 1, 0.5], (n, 3)),
        "direction": rng.normal([0.2, -0.1, 0.8], 0.3, (n, 3)),
        "flux": rng.gamma(1.0, 3.0, n),
    }
    return {name: column.astype("f4").astype("f8") for name, column in columns.items()}


def unit(direction: np.ndarray) -> np.ndarray:
    return direction / np.linalg.norm(direction, axis=1, keepdims=True)


def records(dtype: Any, n: int = N) -> np.ndarray:
    """Records of any layout with the same values, and rubbish in the gaps."""
    kind = np.dtype(dtype)
    raw = np.random.default_rng(5).integers(0, 256, n * kind.itemsize, dtype=np.uint8)
    table = raw.view(kind)
    for name, column in values(n).items():
        if name in (kind.names or ()):
            table[name] = column
    return table


LAYOUTS: dict[str, Any] = {
    "f4 packed": [("position", "<f4", 3), ("direction", "<f4", 3), ("flux", "<f4")],
    "f8 packed": [("position", "<f8", 3), ("direction", "<f8", 3), ("flux", "<f8")],
    "another order": [("flux", "<f4"), ("direction", "<f4", 3), ("wavelength", "<f4"), ("position", "<f4", 3)],
    "unaligned": {
        "names": ["position", "direction", "flux"],
        "formats": [("<f8", 3), ("<f8", 3), "<f8"],
        "offsets": [1, 27, 53],
        "itemsize": 67,
    },
    "big stride": {
        "names": ["direction", "flux", "position"],
        "formats": [("<f4", 3), "<f4", ("<f4", 3)],
        "offsets": [3, 4001, 4005],
        "itemsize": 5003,
    },
    "overlapping": {  # legal: the position is read from the direction's bytes and so on is up to the reader
        "names": ["position", "direction", "flux"],
        "formats": [("<f4", 3), ("<f4", 3), "<f4"],
        "offsets": [16, 4, 0],
        "itemsize": 28,
    },
}


# --- what it holds ---------------------------------------------------------------------------------------------------


def test_columns_are_in_millimetres_unit_vectors_and_f64() -> None:
    v = values()
    rays = RaySet(v["position"], v["direction"], v["flux"])
    np.testing.assert_array_equal(rays.position, v["position"])
    np.testing.assert_allclose(rays.direction, unit(v["direction"]), rtol=1e-15)
    np.testing.assert_array_equal(rays.flux, v["flux"])
    assert {a.dtype for a in (rays.position, rays.direction, rays.flux)} == {np.dtype(np.float64)}
    assert (len(rays), rays.flux_unit, rays.wavelength, rays.columns) == (N, "lm", None, ())


@pytest.mark.parametrize("layout", LAYOUTS.values(), ids=LAYOUTS)
def test_every_layout_of_records_reads_the_same_rays(layout: Any) -> None:
    rays, v = RaySet.from_records(records(layout), RaySetMeaning(length_scale=25.4)), values()
    np.testing.assert_allclose(rays.position, v["position"] * 25.4, rtol=1e-6)
    (batch,) = rays.batches()
    np.testing.assert_allclose(batch.position, rays.position, rtol=1e-15)
    np.testing.assert_allclose(batch.direction, unit(v["direction"]), rtol=1e-15)
    np.testing.assert_array_equal(batch.flux, v["flux"])
    assert rays.total_flux == pytest.approx(math.fsum(v["flux"]), rel=1e-14)


def test_mapped_records_stay_in_the_file(tmp_path: Path) -> None:
    table = records(LAYOUTS["f4 packed"])
    path = tmp_path / "rays.bin"
    path.write_bytes(b"header of odd length." + table.tobytes())
    mapped = np.memmap(path, table.dtype, "r", offset=21, shape=(N,))
    rays = RaySet.from_records(mapped, RaySetMeaning())
    assert rays.records is mapped
    np.testing.assert_array_equal(rays.flux, values()["flux"])
    assert rays.total_flux == RaySet.from_records(table, RaySetMeaning()).total_flux
    assert not np.shares_memory(rays.subset(10, seed=1).records, mapped)  # a small copy, in memory


def test_far_field_records_have_directions_only() -> None:
    rays = RaySet.from_records(records([("direction", "<f4", 3), ("flux", "<f4")]), RaySetMeaning())
    assert not rays.has_position
    np.testing.assert_array_equal(rays.position, np.zeros((N, 3)))
    np.testing.assert_allclose(next(rays.batches()).direction, unit(values()["direction"]), rtol=1e-15)
    assert not rays.virtual_focus.determined


def test_further_columns_come_in_their_units() -> None:
    table = np.zeros(
        3,
        [
            ("position", "<f4", 3), ("direction", "<f4", 3), ("flux", "<f4"), ("wavelength", "<f4"),
            ("spectrum_index", "<f4"), ("stokes", "<f4", 3), ("radiant_flux", "<f4"),
        ],
    )  # fmt: skip
    table["direction"] = (0, 0, 1)
    table["flux"] = (1, 2, 5)
    table["wavelength"] = (0.45, 0.5, 0.75)
    table["spectrum_index"] = (1, 2, 1)
    table["stokes"] = np.arange(9).reshape(3, 3)
    table["radiant_flux"] = (0.5, 0.25, 1.0)
    meaning = RaySetMeaning(wavelength_scale=1000.0, declared_flux=16.0)
    rays = RaySet.from_records(table, meaning)
    assert rays.columns == ("wavelength", "spectrum_index", "stokes", "radiant_flux")
    assert rays.wavelength is not None
    assert rays.wavelength.tolist() == pytest.approx([450, 500, 750], rel=1e-6)
    assert rays.column("spectrum_index").tolist() == [1, 2, 1]
    assert rays.column("spectrum_index").dtype == np.int64
    assert rays.column("stokes", slice(1, 3)).tolist() == [[3, 4, 5], [6, 7, 8]]
    # Stored on the scale of the flux, which here is doubled: watts per lumen of a ray stay as they are.
    assert rays.column("radiant_flux").tolist() == [1.0, 0.5, 2.0]
    with pytest.raises(UnknownNameError, match=r"'wavelenght'. Did you mean 'wavelength'\?"):
        rays.column("wavelenght")


def test_a_single_wavelength_is_that_of_every_ray() -> None:
    rays = RaySet.from_records(records(LAYOUTS["f4 packed"], 3), RaySetMeaning(single_wavelength=632.8))
    assert rays.wavelength is not None
    assert rays.wavelength.tolist() == [632.8] * 3


def test_replace_reads_the_same_records_in_another_sense() -> None:
    rays = RaySet(**values())
    other = rays.replace(flux_unit="W", length_scale=10.0)
    assert (other.flux_unit, rays.flux_unit) == ("W", "lm")
    np.testing.assert_allclose(other.position, 10 * rays.position)
    assert other.records is rays.records


def test_repr_makes_no_pass() -> None:
    rays = RaySet(**values())
    assert repr(rays) == "<RaySet of 257 rays in lm from memory>"
    assert rays._tally is None


# --- flux ------------------------------------------------------------------------------------------------------------


def test_absolute_flux_is_the_stored_one_times_its_unit() -> None:
    rays = RaySet.from_records(records(LAYOUTS["f4 packed"]), RaySetMeaning(stored_flux_scale=1e-3))
    np.testing.assert_allclose(rays.flux, 1e-3 * values()["flux"], rtol=1e-15)
    assert rays.total_flux == pytest.approx(1e-3 * math.fsum(values()["flux"]), rel=1e-14)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(st.floats(1e-12, 1e12), st.floats(1e-9, 1e9))
def test_relative_flux_shares_the_declared_total(declared: float, stored_scale: float) -> None:
    rays = RaySet.from_records(
        records(LAYOUTS["f8 packed"]), RaySetMeaning(declared_flux=declared, stored_flux_scale=stored_scale)
    )
    assert rays.total_flux == declared  # exactly
    assert math.fsum(rays.flux) == pytest.approx(declared, rel=1e-13)
    np.testing.assert_allclose(rays.flux / rays.flux[0], values()["flux"] / values()["flux"][0], rtol=1e-13)


@pytest.mark.parametrize("relative", [True, False])
@pytest.mark.parametrize(
    ("disagreement", "complains"), [(1.00101, True), (0.99899, True), (1.00099, False), (1.0, False)]
)
def test_a_total_that_contradicts_the_rays_is_complained_about_with_both_numbers(
    relative: bool, disagreement: float, complains: bool
) -> None:
    table = records(LAYOUTS["f8 packed"])
    table["flux"] *= 100 / table["flux"].sum()
    table["direction"] = unit(table["direction"])
    stated = 0.5 * 100 * disagreement
    meaning = RaySetMeaning(
        declared_flux=stated if relative else None,
        stored_flux_scale=0.5,
        header={"total_flux": stated},
        provenance=FILE,
    )
    rays = RaySet.from_records(table, meaning)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        total = rays.total_flux
        assert rays.total_flux == total  # a second look does not warn again
    assert total == pytest.approx(stated if relative else 50.0, rel=1e-12)
    if not complains:
        assert caught == []
        assert rays.complaints == ()
        return
    (warning,) = caught
    assert warning.category is RayFileWarning
    message = str(warning.message)
    assert f"led.ray: warning: total flux: the header says {stated:.7g} lm, the rays sum to 50" in message
    assert ("are scaled to the header's total" if relative else "the rays' sum is kept") in message
    assert [c.place for c in rays.complaints] == ["total flux"]


def test_a_total_is_only_noted_where_the_format_has_relative_values() -> None:
    meaning = RaySetMeaning(declared_flux=50.0, relative_by_format=True, header={"total_flux": 50.0})
    (complaint,) = RaySet.from_records(records(LAYOUTS["f8 packed"]), meaning).complaints  # and warns of nothing
    assert (complaint.severity, complaint.place) == ("note", "total flux")
    assert "50 lm" in complaint.found


@pytest.mark.parametrize("stated", [math.nan, math.inf, 0.0, -3.0, None, "337"])
def test_a_header_without_a_usable_total_contradicts_nothing(stated: Any) -> None:
    rays = RaySet.from_records(records(LAYOUTS["f8 packed"]), RaySetMeaning(header={"total_flux": stated}))
    assert rays.complaints == ()


def test_rays_without_any_flux_cannot_share_a_total() -> None:
    dark = RaySet(np.zeros((2, 3)), np.ones((2, 3)), [0.0, 0.0])
    with pytest.raises(ArgumentError, match="its rays carry no flux, so 5 lm cannot be shared in proportion to it"):
        dark.with_total_flux(5.0)
    with pytest.raises(ArgumentError, match="carry no flux"):
        dark.with_total_flux(5.0, "W")


# --- complaints ------------------------------------------------------------------------------------------------------


def test_the_reader_s_complaints_come_before_those_of_the_pass() -> None:
    table = records(LAYOUTS["f4 packed"])
    table["flux"][3] = -1
    said = Complaint("note", "byte 4", "version 7")
    rays = RaySet.from_records(table, RaySetMeaning(complaints=(said,), provenance=FILE))
    with pytest.warns(RayFileWarning) as caught:
        found = rays.complaints
    assert [str(w.message) for w in caught] == [f"led.ray: {c}" for c in found[1:]]  # notes do not warn
    assert found[0] == said
    assert [c.severity for c in found] == ["note", "error", "warning"]
    assert "direction lengths differ from 1" in found[2].found


def test_direction_lengths_are_a_matter_of_files_only() -> None:
    table = records(LAYOUTS["f4 packed"])
    assert RaySet.from_records(table, RaySetMeaning()).complaints == ()
    table["direction"] = unit(table["direction"])
    assert RaySet.from_records(table, RaySetMeaning(provenance=FILE)).complaints == ()


def test_directions_that_cannot_be_used_are_kept_as_stored() -> None:
    direction = [[0, 0, 2], [0, 0, 0], [math.nan, 0, 1], [math.inf, 0, 0], [1e200, 0, 0], [0, 3e-7, 0]]
    rays = RaySet(np.zeros((6, 3)), direction, np.ones(6))
    np.testing.assert_array_equal(rays.direction, [[0, 0, 1], *direction[1:]])


# --- refusals --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"position": np.zeros((N, 2))}, r"position has shape \(257, 2\); with 257 rays it must be \(257, 3\)"),
        ({"direction": np.zeros((N - 1, 3))}, "direction has shape"),
        ({"flux": np.zeros((N, 1))}, "flux has shape"),
        ({"wavelength": np.zeros(3)}, r"wavelength has shape \(3,\)"),
    ],
)
def test_refuses_columns_whose_shapes_disagree(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        RaySet(**(values() | changes))


P, D, F = ("position", "<f4", 3), ("direction", "<f4", 3), ("flux", "<f4")


@pytest.mark.parametrize(
    ("fields", "error", "message"),
    [
        ([P, F], ArgumentError, "need the fields 'direction' and 'flux'"),
        ([P, D], ArgumentError, "need the fields 'direction' and 'flux'"),
        ([P, D, ("flux", "<f8")], ArgumentError, "all '<f4' or all '<f8'"),
        ([("position", ">f4", 3), ("direction", ">f4", 3), ("flux", ">f4")], ArgumentError, "all '<f4' or all '<f8'"),
        ([("position", "<i4", 3), ("direction", "<i4", 3), ("flux", "<i4")], ArgumentError, "all '<f4'"),
        ([P, ("direction", "<f4", 2), F], ArgumentError, r"'direction' has shape \(2,\); it must be \(3,\)"),
        ([("position", "<f4", 4), D, F], ArgumentError, r"'position' has shape \(4,\)"),
        ([P, D, ("flux", "<f4", 2)], ArgumentError, r"'flux' has shape \(2,\); it must be \(\)"),
        ([P, D, F, ("wavelenght", "<f4")], UnknownNameError, "Did you mean 'wavelength'"),
    ],
)
def test_refuses_records_that_do_not_mean_rays(fields: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        RaySet.from_records(np.zeros(4, fields), RaySetMeaning())


def test_refuses_records_that_are_not_one_contiguous_row() -> None:
    table = records(LAYOUTS["f4 packed"], 12)
    for scattered in (table[::2], table[::-1], table.reshape(3, 4), table.reshape(4, 3).T[0]):
        with pytest.raises(ArgumentError, match="not one contiguous row"):
            RaySet.from_records(scattered, RaySetMeaning())
    assert len(RaySet.from_records(table[3:7], RaySetMeaning())) == 4


def test_refuses_records_without_fields() -> None:
    with pytest.raises(ArgumentError, match="need the fields"):
        RaySet.from_records(np.zeros((4, 7)), RaySetMeaning())


def test_an_unknown_flux_unit_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="unknown flux unit 'lumen'"):
        RaySet(**values(), flux_unit="lumen")  # type: ignore[arg-type]


def test_meaning_and_spectra_are_kept() -> None:
    spectrum = Spectrum([400.0, 700.0], [1.0, 2.0])
    rays = RaySet(**values(), flux_unit="W", spectra=(spectrum,), provenance=FILE)
    assert rays.spectra == (spectrum,)
    assert rays.provenance == FILE
    assert dataclasses.replace(rays.meaning, spectra=()) == RaySetMeaning(flux_unit="W", provenance=FILE)


def test_a_signalling_nan_passes_in_silence_and_is_counted() -> None:
    """Damaged files hold them; numpy would warn at every conversion."""
    records = np.zeros(2, [("position", "<f4", 3), ("direction", "<f4", 3), ("flux", "<f4")])
    records["direction"] = (0, 0, 1)
    records["flux"] = np.array([0x7F800001, 0x3F800000], "<u4").view("<f4")
    rays = RaySet.from_records(records, RaySetMeaning())
    assert np.isnan(rays.flux[0])
    with pytest.warns(RayFileWarning, match="1 of 2 rays have a coordinate"):
        assert rays.total_flux == 1.0
