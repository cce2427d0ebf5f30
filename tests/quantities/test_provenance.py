"""Where values come from, and what is said about them."""

from __future__ import annotations

import dataclasses
import importlib.metadata
import json
import tomllib
from pathlib import Path

import pytest
from etendue.quantities.provenance import Provenance, version
from etendue.quantities.report import Complaint


def test_steps_are_added_in_order_to_a_copy() -> None:
    first = Provenance(source="led.ray", format="lighttools", fingerprint="ab12")
    last = first.then("moved").then("subset")
    assert first.steps == ()
    assert last.steps == ("moved", "subset")
    assert (last.source, last.format, last.fingerprint) == ("led.ray", "lighttools", "ab12")


def test_survives_json() -> None:
    provenance = Provenance("a/ü.ray", "tm25", "00ff", ("one", "two"), "other 9.9")
    assert Provenance.from_dict(json.loads(json.dumps(provenance.to_dict()))) == provenance


def test_names_the_software_that_is_installed() -> None:
    manifest = Path(__file__).resolve().parents[2] / "Cargo.toml"
    stated = tomllib.loads(manifest.read_text())["workspace"]["package"]["version"]
    assert version() == importlib.metadata.version("etendue") == stated
    assert Provenance().software == f"etendue {stated}"


def test_cannot_be_changed() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        Provenance().source = "another"  # type: ignore[misc]


def test_a_complaint_reads_as_one_line_with_its_clause_only_if_it_has_one() -> None:
    bare = Complaint("error", "line 7", "3 numbers, not 7")
    assert str(bare) == "error: line 7: 3 numbers, not 7"
    assert str(dataclasses.replace(bare, clause="TM-25 4.8")) == "error: line 7: 3 numbers, not 7 [TM-25 4.8]"
    assert json.loads(json.dumps(bare.to_dict())) == {
        "severity": "error", "place": "line 7", "found": "3 numbers, not 7", "clause": "",
    }  # fmt: skip
