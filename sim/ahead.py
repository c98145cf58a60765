"""What takes a while, made in the background before it is asked for."""

from __future__ import annotations

import os
from collections import OrderedDict
from concurrent.futures import Future
from threading import Lock, Thread
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

Made = TypeVar("Made")


class Ahead(Generic[Made]):
    """Makes things by their labels, each once, on as many threads as there are processors.

    The threads end as soon as nothing is left to make, and with the program.

    Parameters
    ----------
    make
        Makes one thing; may be called on several threads at once.
    """

    def __init__(self, make: Callable[[int], Made]) -> None:
        self._make = make
        self._lock = Lock()
        self._futures: dict[int, Future[Made]] = {}
        self._waiting: OrderedDict[int, Future[Made]] = OrderedDict()
        self._threads = 0

    def begin(self, labels: Iterable[int]) -> None:
        """Begin to make things, in this order; do not wait for them."""
        with self._lock:
            for label in labels:
                if label not in self._futures:
                    self._futures[label] = self._waiting[label] = Future()
            threads = min(os.cpu_count() or 1, len(self._waiting)) - self._threads
            self._threads += max(0, threads)
        for _ in range(threads):
            Thread(target=self._work, daemon=True).start()

    def get(self, label: int) -> Made:
        """Wait for a thing; one that no thread has begun is made here and now."""
        with self._lock:
            new = label not in self._futures
            future = self._futures.setdefault(label, Future())
            unclaimed = self._waiting.pop(label, None) is not None or new
        if unclaimed:
            self._fill(future, label)
        return future.result()

    def _work(self) -> None:
        while True:
            with self._lock:
                if not self._waiting:
                    self._threads -= 1
                    return
                label, future = self._waiting.popitem(last=False)
            self._fill(future, label)

    def _fill(self, future: Future[Made], label: int) -> None:
        try:
            future.set_result(self._make(label))
        except Exception as error:  # whoever asks for it gets it
            future.set_exception(error)
