"""Loops over numbers, compiled where numba is installed (``pip install "chainrig[resolved]"``).

Without it the same lines run as they stand, to the same bits, a few hundred times as slowly.
"""

from __future__ import annotations

from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeVar

try:
    numba: Any = import_module("numba")
except ImportError:
    numba = None

if TYPE_CHECKING:
    from collections.abc import Callable

    Function = TypeVar("Function", bound=Callable[..., Any])


def is_compiled() -> bool:
    """Whether loops are compiled here, and not run as they stand."""
    return numba is not None and not numba.config.DISABLE_JIT


def jit(function: Function, *, keep: bool = True, inline: str = "never") -> Function:
    """Compile a function when it is first called; threads may run it side by side.

    Parameters
    ----------
    function
        Loops over numbers.
    keep
        Keep it on the disk. It is compiled anew once its own file changes, but not when another
        one does: what is kept belongs into one file with all that it calls.
    inline
        ``always``: put its lines where it is called. A world has some 300 numbers to be passed.
    """
    if numba is None:
        return function
    compiled = partial(numba.njit, nogil=True, error_model="numpy", inline=inline)
    try:
        loops: Function = compiled(cache=keep)(function)
    except RuntimeError:  # there is no folder that it may keep it in
        loops = compiled()(function)
    return loops


inlined = partial(jit, inline="always")
"""As `jit`, for the parts of a step."""
