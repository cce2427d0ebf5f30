"""Which statistical tests would not notice an error of 5 %?

The tests are run as they are, to see which give verdicts on which estimates. Then one estimate after the other is multiplied
by a factor wherever it is made (`oracles.planting`), and the tests on it are run again. Listed are those that pass all the
same. A test that compares two values of the same estimate, or looks at shapes, bits or errors alone, cannot notice a common
factor; `UNMOVED` says of each why it may stay green, and the program ends with 1 if another one does.

usage: python tests/mutate.py [--factor 1.05] [--files FILE …] [ESTIMATE …]
"""

from __future__ import annotations

import argparse
import fnmatch
import multiprocessing
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from oracles.planting import Run

TESTS = Path(__file__).resolve().parent

SAME = "compares the estimate with itself"
ERRORS = "judges errors, or numbers of rays, alone"
ELSEWHERE = "judges other detectors, or the account, of the same trace"

UNMOVED: tuple[tuple[str, str, str], ...] = (
    ("*", "*same_bits*", SAME),
    ("*", "*same_bytes*", SAME),
    ("cone", "*::test_the_automatic_map_is_the_cone_map_at_the_chosen_acceptance", SAME),
    ("cone", "*::test_runs_joined_equal_the_source_with_all_runs", SAME),
    ("cone", "*::test_what_is_unknown_stays_unknown", SAME),
    ("*", "*::test_a_map_through_a_filter_takes_the_spectrum_of_the_field*", SAME + ": a ratio of two maps"),
    ("light-field", "*::test_drawn_rays_have_wavelengths_with_their_shares", SAME + ": shares of its own flux"),
    (
        "light-field",
        "*::test_scores_of_surfaces_compare_the_same_rays",
        "scores are of densities, which integrate to 1",
    ),
    ("light-field", "*::test_a_symmetry_tells_of_twice_the_rays", "judges densities, which integrate to 1"),
    (
        "traced-rays",
        "*::test_interpolated_normals_move_light_at_the_rim*",
        "counts where rays pass, whatever their flux",
    ),
    ("*", "*/test_running.py::test_a_part_stands_for_the_whole", SAME + ": a part of a trace with all of it"),
    ("intensity", "*::test_nodes_and_peaks_lie_within_their_errors*", "nodes of few rays, which err by more than 5 %"),
    ("smoothing", "*::test_error_bars_hold_for_few_rays_and_many*", "cells of few rays, which err by more than 5 %"),
    ("smoothing", "*::test_the_unit_of_weight_does_not_matter", SAME),
    ("lines-of-sight", "*::test_glints_in_glass*", SAME + " from close by; the lamp and the mirror have closed forms"),
    ("traced-rays", "*/test_exact.py::test_far_field_of_a_cosine_emitter*", ELSEWHERE),
    ("traced-rays", "*/test_exact.py::test_luminance_out_of_a_dome", ELSEWHERE),
    ("patches", "*::test_pixels_are_means_over_lines_of_sight*", SAME),
    ("patches", "*::test_sample_and_tables_agree*", SAME),
    ("*", "*::test_events_of_a_ray_stay_together_in_any_stretch", SAME),
    ("*", "*::test_default_maps_are_unbiased_with_errors_that_hold*", SAME + ", at more rays"),
    ("traced-cells", "*::test_sources_that_share_a_file_share_its_rays", SAME),
    ("lines-of-sight", "*::test_cemented_bodies_are_one", SAME),
    ("lines-of-sight", "*::test_triangles_of_a_mesh_are_patches", SAME + "; gathered-lines moves one side alone"),
    ("*", "*::test_both_routes_go_on_until_the_error_is_reached", ERRORS),
    ("*", "*::test_more_passes_until_the_error_is_reached", ERRORS),
    ("*", "*/test_gathering.py::test_noise_is_much_smaller", ERRORS),
    ("*", "*/test_scene_map.py::test_error_bars_hold", ERRORS),
    ("cone", "*/test_cone.py::test_the_error_bars_cover", ERRORS + "; the luminance of each ring is another test's"),
    ("traced-cells", "*::test_light_from_behind_is_not_counted", "judges where there is light"),
    ("traced-*", "*::test_what_events_say", ELSEWHERE),
    ("traced-rays", "*::test_the_far_field_of_a_searchlight", ELSEWHERE),
    ("traced-rays", "*::test_what_is_seen_from_everywhere_is_the_flux", ELSEWHERE),
    ("flux-account", "*::test_a_field_shines_with_its_spectrum_forwards", "reads what was emitted, known beforehand"),
    ("traced-cells", "*::test_where_the_light_ends", ELSEWHERE),
    ("traced-cells", "*::test_nothing_is_brighter_than_its_source*", "an upper bound, which no cell reaches"),
    (
        "forward-light",
        "*::test_nothing_is_brighter_than_its_source*",
        "an upper bound, which only direct light reaches",
    ),
    (
        "light-field",
        "*::test_colours_and_light_fields_are_gathered_too",
        "the source's flux is stated: its field is scaled",
    ),
    ("*", "*::test_rays_as_a_source_are_counted_once", "all light of a map errs by 2.4 %, that of 12 000 rays"),
    # How much light of the scene the estimate is: 5 % of that are below what the test resolves.
    ("forward-light", "*::test_with_what_lines_of_sight_find_besides", "1.1 % of the light of the map"),
    ("traced-cells", "*::test_with_what_lines_of_sight_find_besides", "1.1 % of the light of the map"),
    ("forward-light", "*::test_a_lens_over_a_white_floor_in_an_even_surround", "0.7 % of the light of the map at most"),
    ("traced-cells", "*::test_a_lens_over_a_white_floor_in_an_even_surround", "0.7 % of the light of the map at most"),
    ("forward-light", "*::test_what_is_seen_from_everywhere_is_the_flux", "a fifth of the light of the maps"),
    (
        "lines-of-sight",
        "*::test_light_image_and_lines_of_sight_show_the_same[[]reflector*",
        "0.6 % of the light of the map",
    ),
    (
        "traced-cells",
        "*::test_light_image_and_lines_of_sight_show_the_same[[]reflector*",
        "made of rays forwards on both sides",
    ),
)
"""Patterns of estimates and tests that a common factor does not move, each with the reason."""


def statistical() -> list[str]:
    """The test files that judge what errs by chance."""
    from oracles.planting import VERDICTS

    files = sorted(TESTS.glob("*/test_*.py"))
    words = {"oracles.verdicts", *VERDICTS}
    return [str(path) for path in files if any(word in path.read_text(encoding="utf-8") for word in words)]


def run(estimate: str | None, factor: float, tests: Sequence[str]) -> dict[str, Run]:
    """All of these tests, with one estimate spoilt or none."""
    from oracles.planting import Planting

    planting = Planting(estimate, factor)
    pytest.main(["-q", "--no-header", "-rN", "--show-capture=no", "--tb=no", *tests], plugins=[planting])
    return planting.found


def run_apart(estimate: str | None, factor: float, tests: Sequence[str]) -> dict[str, Run]:
    """The same in a process of its own, where nothing is left over from other runs."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        return pool.submit(run, estimate, factor, tests).result()


def reason_for(estimate: str, test: str) -> str | None:
    """Why a test may stay green, if there is a reason."""
    match = fnmatch.fnmatchcase
    return next((why for of, tests, why in UNMOVED if match(estimate, of) and match(test, tests)), None)


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
    parser.add_argument("--files", nargs="*", help="test files; those that give statistical verdicts if left out")
    chosen = parser.parse_args()
    unknown = set(chosen.estimates) - set(ESTIMATES)
    if unknown:
        parser.error(f"no such estimate: {', '.join(sorted(unknown))}; there are {', '.join(ESTIMATES)}")
    sound = run_apart(None, 1.0, chosen.files or statistical())
    failed = [test for test, found in sound.items() if found.outcome == "failed"]
    for test in failed:
        say(f"{test}: fails as it is")
    unexplained = len(failed)
    for estimate in chosen.estimates or ESTIMATES:
        judged = [test for test, found in sound.items() if estimate in found.judged]
        spoilt = run_apart(estimate, chosen.factor, judged) if judged else {}
        passed = [test for test in judged if spoilt[test].outcome == "passed"]
        say(f"{estimate} × {chosen.factor}: {len(judged)} tests give verdicts on it, {len(passed)} stay green")
        for test in passed:
            reason = reason_for(estimate, test)
            unexplained += reason is None
            say(f"  {test}: {reason or 'UNEXPLAINED'}")
    return 1 if unexplained else 0


if __name__ == "__main__":
    sys.path.insert(0, str(TESTS))
    os.chdir(TESTS.parent)
    sys.exit(main())
