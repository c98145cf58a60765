"""One thread for linear algebra: with small matrices, threads get in each other's way."""

from __future__ import annotations

from functools import cache, wraps
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

P = ParamSpec("P")
T = TypeVar("T")


def one_thread(work: Callable[P, T]) -> Callable[P, T]:
    """Have a function's matrices multiplied by one thread, whoever calls it.

    With several, a sum's last digits depend on how busy the machine is, and on two cores the same
    work costs twice the processor time. Others' matrices are theirs: the bound ends with the call.
    """

    @wraps(work)
    def bounded(*args: P.args, **kwargs: P.kwargs) -> T:
        with libraries().limit(limits=1, user_api="blas"):
            return work(*args, **kwargs)

    return bounded


@cache
def libraries() -> Any:
    """Find the libraries that multiply numpy's matrices; to look takes some milliseconds.

    scipy may bring another one later, which special functions do not use.
    """
    import numpy as np  # noqa: F401, PLC0415 - it is what loads them
    from threadpoolctl import ThreadpoolController  # noqa: PLC0415 - only with numpy

    return ThreadpoolController()
