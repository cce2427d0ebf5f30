"""One noun, one file: a file that grows beyond a few screens holds several, and is split where they part."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

MOST_LINES = 500


@pytest.mark.parametrize(
    ("pattern", "known"),
    [("python/etendue/**/*.py", 300), ("crates/*/src/**/*.rs", 150)],
    ids=["Python", "Rust"],
)
def test_no_source_file_is_too_long(pattern: str, known: int) -> None:
    """There are no exceptions: docstrings, comments and the tests that a Rust file holds count as they are read."""
    lines = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in ROOT.glob(pattern)}
    assert len(lines) > known
    long = [f"{path.relative_to(ROOT)}: {count} lines" for path, count in sorted(lines.items()) if count > MOST_LINES]
    assert not long, f"split along their nouns, {MOST_LINES} lines at most: " + "; ".join(long)
