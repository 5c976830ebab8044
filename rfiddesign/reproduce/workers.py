"""Parts of a reproduction that need nothing of each other, on threads; compiled code runs side by side."""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def in_threads(function: Callable[[Item], Result], items: Iterable[Item], n_workers: int | None) -> Iterator[Result]:
    """Results in the order of the items, on `n_workers` threads (None: one per core).

    An interruption waits for what is under way, not for what has not begun.
    """
    pool = ThreadPoolExecutor(n_workers or os.cpu_count())
    try:
        yield from pool.map(function, items)
    finally:
        pool.shutdown(cancel_futures=True)
