"""A number that an example found, beside what it must be by another way: an example that is wrong says so and fails."""

from __future__ import annotations

WIDE = 4.0
"""Standard errors by which a right number may be off: one in 16 000 is by chance."""


def agree(what: str, found: float, truth: float, error: float) -> None:
    """Print both, and stop the example if they differ by more than `WIDE` standard errors."""
    print(f"{what}: {found:.5g} ± {error:.2g}, by the formula {truth:.5g}")
    if not abs(found - truth) <= WIDE * error:
        raise SystemExit(
            f"{what}: found {found:.6g}, expected {truth:.6g}, which is more than {WIDE:g} × {error:.2g} off"
        )
