"""Which statistical tests would not notice an error of 5 %?

One estimate after the other is multiplied by a factor wherever it is made (`oracles.planting`), and the tests are run that
give statistical verdicts. Listed are those which made that estimate and passed all the same. A test that compares two values
of the same estimate, or looks at shapes, bits or errors of errors, cannot notice a common factor;
`UNMOVED` says of each why it may stay green, and the program ends with 1 if another one does.

usage: python tests/mutate.py [--factor 1.05] [ESTIMATE …]
"""

from __future__ import annotations

import argparse
import fnmatch
import os
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parent

SAME = "compares the same estimate with itself, bit by bit"

UNMOVED: dict[str, str] = {
    "*::test_the_same_bits_*": SAME,
    "*::test_looked_at_from_a_file_in_another_place": SAME,
    "*::test_a_scene_that_lives_in_memory_can_be_given": SAME,
    "*::test_events_of_a_ray_stay_together_in_any_stretch": SAME,
}
"""Patterns of tests that a common factor does not move, each with the reason."""


def statistical() -> list[Path]:
    """The test files that give verdicts at a stated significance."""
    words = ("oracles.verdicts", "SIGNIFICANCE", "LARGEST_Z", "chi2")
    files = sorted(TESTS.glob("*/test_*.py"))
    return [path for path in files if any(word in path.read_text(encoding="utf-8") for word in words)]


def green(estimate: str, factor: float, files: list[Path]) -> list[str]:
    """The tests that made the estimate and passed although it was off."""
    from oracles.planting import Planting

    planting = Planting(estimate, factor)
    pytest.main(["-q", "--no-header", "-rN", "--show-capture=no", *map(str, files)], plugins=[planting])
    passed, before = [], 0
    for test, (calls, outcome) in planting.found.items():
        if calls > before and outcome == "passed":
            passed.append(test)
        before = calls
    return passed


def say(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main() -> int:
    """Run everything, and say what stays green."""
    from oracles.planting import ESTIMATES

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("estimates", nargs="*", metavar="ESTIMATE", help=", ".join(ESTIMATES))
    parser.add_argument("--factor", type=float, default=1.05)
    parser.add_argument(
        "--files", nargs="*", type=Path, help="test files; those that give statistical verdicts if left out"
    )
    chosen = parser.parse_args()
    unknown = set(chosen.estimates) - set(ESTIMATES)
    if unknown:
        parser.error(f"no such estimate: {', '.join(sorted(unknown))}; there are {', '.join(ESTIMATES)}")
    unexplained = 0
    for estimate in chosen.estimates or ESTIMATES:
        passed = green(estimate, chosen.factor, chosen.files or statistical())
        say(f"{estimate} × {chosen.factor}: {len(passed)} tests stay green")
        for test in passed:
            reason = next((why for pattern, why in UNMOVED.items() if fnmatch.fnmatch(test, pattern)), None)
            unexplained += reason is None
            say(f"  {test}: {reason or 'UNEXPLAINED'}")
    return 1 if unexplained else 0


if __name__ == "__main__":
    sys.path.insert(0, str(TESTS))
    os.chdir(TESTS.parent)
    sys.exit(main())
