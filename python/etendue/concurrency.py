"""Threads: work on several items at once with their results in order, and threads of NumPy that are in the way."""

from __future__ import annotations

import contextlib
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

from threadpoolctl import ThreadpoolController

Item = TypeVar("Item")
Result = TypeVar("Result")


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


class OneBlasThread(contextlib.ContextDecorator):
    """NumPy's linear algebra on one thread, for work that takes turns with the core: by ``with``, or as a decorator.

    OpenBLAS, which NumPy's wheels bring, keeps its threads running for some hundredths of a second after each product, in
    case there is another: on processors that the core's threads want by then. What is set is the number of threads of the
    whole process: products of other threads of Python have one, too, until the last of those who asked for it has done.

    Examples
    --------
    >>> import numpy as np
    >>> with one_blas_thread:
    ...     np.ones((2, 2)) @ np.ones(2)
    array([2., 2.])
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._within = 0
        self._limit: contextlib.AbstractContextManager[object] = contextlib.nullcontext()

    def __enter__(self) -> None:
        with self._lock:
            self._within += 1
            if self._within == 1:
                self._limit = ThreadpoolController().limit(limits=1, user_api="blas")
                self._limit.__enter__()

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._within -= 1
            if not self._within:
                self._limit.__exit__(None, None, None)


one_blas_thread = OneBlasThread()
"""The one for all: it counts who is within."""
