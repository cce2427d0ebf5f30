"""Items that are worked on side by side: their order, how many at once, and what fails."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest
from etendue.concurrency import in_order


def test_results_keep_their_order_though_later_items_are_ready_first() -> None:
    second_done = threading.Event()

    def work(item: int) -> int:
        if item == 0:
            assert second_done.wait(30)  # which only another thread can set
        if item == 1:
            second_done.set()
        return 10 * item

    assert list(in_order(work, range(7), 2)) == [0, 10, 20, 30, 40, 50, 60]


def test_no_more_items_are_taken_than_are_worked_on() -> None:
    taken: list[int] = []

    def items() -> Iterator[int]:
        for item in range(100):
            taken.append(item)
            yield item

    results = in_order(lambda item: item, items(), 3)
    assert next(results) == 0
    assert len(taken) == 4
    results.close()
    assert len(taken) == 4


def test_an_error_is_raised_in_its_place_and_ends_the_work() -> None:
    done: list[int] = []

    def work(item: int) -> int:
        if item == 2:
            raise ValueError("two")
        return item

    with pytest.raises(ValueError, match="two"):
        done.extend(in_order(work, range(100), 2))
    assert len(done) <= 2
