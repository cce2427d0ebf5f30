"""Where the real, freely licensed files are, which are kept beside the project."""

from __future__ import annotations

from pathlib import Path

SAMPLES = Path(__file__).resolve().parents[3] / "shared" / "samples"
