"""Who computes a sweep: threads of this process, or the workers of a Dask cluster.

Falls of a piece are few large operations of numpy, during which other threads go on.
"""

import logging
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from threading import Thread
from typing import Any

from rig import __version__
from rig.reasons import rig_error
from rig.threads import processors

PATIENCE_S = 8.0


@contextmanager
def executor(jobs: int | None, address: str | None) -> Iterator[tuple[Executor, int]]:
    """Provide who computes, and how many pieces they compute together.

    Parameters
    ----------
    jobs
        Threads; as many as there are processors if not given.
    address
        Of a cluster's scheduler, if that is to compute.

    Raises
    ------
    ClusterError
        If it cannot be reached, has no workers, these have another chainrig, or it breaks off.
    """
    if address is None:
        threads = jobs or processors()
        with ThreadPoolExecutor(threads) as pool:
            yield pool, threads
        return
    from distributed import KilledWorker  # noqa: PLC0415 - an extra
    from distributed.comm.core import CommClosedError  # noqa: PLC0415

    client = _connect(address)
    try:
        yield client.get_executor(pure=False), sum(client.nthreads().values())
    except (KilledWorker, CommClosedError, CancelledError) as error:
        cause = _first_line(error)
        raise rig_error("cluster_lost", address=address, cause=cause) from error
    finally:
        client.close(timeout=PATIENCE_S)


def _connect(address: str) -> Any:
    """Return a client whose workers all compute the same model."""
    for name in ("distributed", "distributed.client"):
        # They tell of every broken connection themselves, with tracebacks.
        logging.getLogger(name).setLevel(logging.CRITICAL)
    answer: Future[tuple[Any, dict[str, str]]] = Future()
    # The client's own timeout does not count once somebody has taken the call and says nothing.
    Thread(target=_ask, args=(address, answer), daemon=True).start()
    try:
        client, versions = answer.result(1.25 * PATIENCE_S)
    except Exception as error:  # whatever answers there may answer anything
        words = {"address": address, "cause": _first_line(error)}
        raise rig_error("cluster_unreachable", **words) from error
    unlike = {worker: theirs for worker, theirs in versions.items() if theirs != __version__}
    if versions and not unlike:
        return client
    client.close(timeout=1.0)
    if not versions:
        raise rig_error("cluster_empty", address=address)
    worker, theirs = unlike.popitem()
    words = {"address": address, "version": __version__, "worker": worker, "other": theirs}
    raise rig_error("cluster_unlike", **words)


def _ask(address: str, answer: Future[tuple[Any, dict[str, str]]]) -> None:
    """Connect, and ask each worker for the version of its chainrig."""
    from distributed import Client  # noqa: PLC0415 - an extra

    class Forgettable(Client):
        """A client that, having failed to connect, does not wait for itself when forgotten."""

        def __del__(self) -> None:
            pass

    try:
        client: Any = Forgettable(address, timeout=PATIENCE_S, set_as_default=False)  # type: ignore[no-untyped-call]
        try:
            versions = client.run(version)
        except ImportError:
            versions = {"a worker": "none"}
        answer.set_result((client, versions))
    except Exception as error:
        answer.set_exception(error)


def version() -> str:
    """Return the version of the chainrig that is asked."""
    return __version__


def _first_line(error: BaseException) -> str:
    return str(error).partition("\n")[0] or type(error).__name__
