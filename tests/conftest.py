"""Fixtures that every suite shares."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def samples() -> Path:
    """The folder of real, freely licensed ray and intensity files, which is kept beside the project."""
    folder = ROOT.parent / "shared" / "samples"
    if not folder.is_dir():
        pytest.skip("the folder of real sample files is not there")
    return folder


@pytest.fixture(autouse=True)
def _names(doctest_namespace: dict[str, object]) -> None:
    """Doctests may use the class they document without importing it."""
    import etendue

    doctest_namespace["RaySet"] = etendue.RaySet
