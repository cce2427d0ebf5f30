"""Threads: work on several items at once with their results in order, and threads of NumPy that are in the way."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

Item = TypeVar("Item")
Result = TypeVar("Result")
Given = ParamSpec("Given")


def in_order(function: Callable[[Item], Result], items: Iterable[Item], workers: int) -> Iterator[Result]:
    """The results of a function for some items, in their order; so many items are worked on at once, and no more.

    For what the core or NumPy does without holding Python's lock. Whoever stops to ask waits for the items in work only.

    Parameters
    ----------
    function : callable
        What is done with each.
    items : iterable
        Whatever it takes.
    workers : int
        Threads.

    Examples
    --------
    >>> list(in_order(lambda x: x * x, range(5), 2))
    [0, 1, 4, 9, 16]
    """
    with ThreadPoolExecutor(workers) as pool:
        waiting: deque[Future[Result]] = deque()
        try:
            for item in items:
                waiting.append(pool.submit(function, item))
                if len(waiting) > workers:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()


def on_one_blas_thread(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """The function, during which NumPy's linear algebra has one thread: for work that takes turns with the core.

    OpenBLAS, which NumPy's wheels bring, keeps its threads running for some hundredths of a second after each product, in
    case there is another: on processors that the core's threads want by then. The number is one of the whole process;
    of several threads of Python only the first sets it, until it is done.

    Parameters
    ----------
    function : callable
        Whatever it takes and gives, it does so afterwards.

    Examples
    --------
    >>> import numpy as np
    >>> on_one_blas_thread(lambda a: a @ a)(np.array([3.0, 4.0])).item()
    25.0
    """
    limited: Callable[Given, Result] = threadpool_limits.wrap(limits=1, user_api="blas")(function)
    return limited
