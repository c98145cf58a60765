"""Who computes: the workers of a Dask cluster."""

from __future__ import annotations

import logging
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager
from threading import Thread
from typing import TYPE_CHECKING, Any, cast

from distributed import Client, KilledWorker
from distributed.comm.core import CommClosedError

from rig import __version__
from rig.sweep.executors import WorkersError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from concurrent.futures import Executor

PATIENCE_S = 8.0
_EXAMPLE = "an address is like tcp://lab-server:8786"


class _Client(Client):
    """A client that, having failed to connect, does not wait for itself when forgotten."""

    def __del__(self) -> None:
        pass


@contextmanager
def cluster(address: str) -> Iterator[tuple[Executor, int]]:
    """Connect to a cluster and provide an executor and the number of its workers' threads.

    Parameters
    ----------
    address
        Of the scheduler.

    Raises
    ------
    WorkersError
        If it cannot be reached, has no workers, these have another chainrig, or it breaks off.
    """
    for name in ("distributed", "distributed.client"):
        # They tell of every broken connection themselves, with tracebacks.
        logging.getLogger(name).setLevel(logging.CRITICAL)
    client, threads = _connected(address, PATIENCE_S)
    try:
        yield cast("Executor", client.get_executor(pure=False)), threads
    except (KilledWorker, CommClosedError, CancelledError) as error:
        raise WorkersError(
            f"--cluster {address}: broke off ({_first_line(error)})", "nothing was written"
        ) from error
    finally:
        client.close(timeout=PATIENCE_S)


def version() -> str:
    """Return the version of the chainrig that is asked."""
    return __version__


def _connected(address: str, patience_s: float) -> tuple[Any, int]:
    """Return a client and the number of its workers' threads."""
    answer: Future[tuple[Any, int]] = Future()

    def connect() -> None:
        try:
            client: Any = _Client(address, timeout=patience_s, set_as_default=False)  # type: ignore[no-untyped-call]
            try:
                answer.set_result((client, _checked(client, address)))
            except Exception:
                client.close(timeout=1.0)
                raise
        except Exception as error:  # whatever answers there may answer anything
            answer.set_exception(error)

    # The client's own timeout does not count once somebody has taken the call and says nothing.
    Thread(target=connect, daemon=True).start()
    try:
        return answer.result(1.25 * patience_s)
    except WorkersError:
        raise
    except Exception as error:
        raise WorkersError(
            f"--cluster {address}: cannot be reached ({_first_line(error)})",
            f"is its scheduler running? {_EXAMPLE}",
        ) from error


def _checked(client: Any, address: str) -> int:
    """Count the workers' threads, once sure that all workers compute the same model."""
    try:
        found = client.run(version)
    except ImportError as error:
        found = {"": f"none ({error})"}
    if not found:
        raise WorkersError(f"--cluster {address}: has no workers", f"dask worker {address}")
    for worker, theirs in found.items():
        if theirs != __version__:
            raise WorkersError(
                f"--cluster {address}: chainrig {__version__} is here, on {worker or 'a worker'} "
                f"is {theirs}",
                "install the same chainrig for the workers",
            )
    return sum(client.nthreads().values())


def _first_line(error: BaseException) -> str:
    return str(error).partition("\n")[0] or type(error).__name__
