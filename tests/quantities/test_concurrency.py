"""Items that are worked on side by side: their order, how many at once, and what fails. Threads of linear algebra."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import etendue as et
import numpy as np
import pytest
from etendue.concurrency import in_order, on_one_blas_thread
from threadpoolctl import threadpool_info, threadpool_limits


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


def blas_threads() -> set[int]:
    """How many threads NumPy's linear algebra has, of each library that is loaded."""
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


@pytest.fixture
def three_threads() -> Iterator[None]:
    """NumPy's linear algebra on three threads, on whatever machine."""
    np.ones((2, 2)) @ np.ones(2)  # the library is loaded
    if not blas_threads():
        pytest.skip("NumPy has a library of linear algebra whose threads cannot be set")
    with threadpool_limits(3, "blas"):
        assert blas_threads() == {3}
        yield


@pytest.mark.usefixtures("three_threads")
def test_linear_algebra_has_one_thread_and_what_was_set_comes_back() -> None:
    assert on_one_blas_thread(blas_threads)() == {1}
    assert blas_threads() == {3}

    @on_one_blas_thread
    def fails() -> None:
        raise ValueError("two")

    with pytest.raises(ValueError, match="two"):
        fails()
    assert blas_threads() == {3}


@pytest.mark.usefixtures("three_threads")
def test_of_two_threads_of_python_neither_leaves_it_limited() -> None:
    entered, left = threading.Event(), threading.Event()

    @on_one_blas_thread
    def longer() -> None:
        entered.set()
        assert left.wait(30)

    thread = threading.Thread(target=longer)

    @on_one_blas_thread
    def first() -> None:
        thread.start()
        assert entered.wait(30)
        assert blas_threads() == {1}

    first()
    left.set()
    thread.join()
    assert blas_threads() == {3}


@pytest.mark.usefixtures("three_threads")
def test_a_fit_leaves_linear_algebra_as_it_was_and_has_one_thread_meanwhile() -> None:
    seen: set[int] = set()
    rays = et.RingSource(rays=2_000)
    et.LightField.fit(rays, et.Disk(radius=30), depths=(2, 2, 2, 2), progress=lambda *_: seen.update(blas_threads()))
    assert seen == {1}
    assert blas_threads() == {3}
