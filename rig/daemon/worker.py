"""The one thread that touches the port and the session file, and that keeps the link alive.

Clients' requests wait in a queue; STOP and the loss of whoever is in control overtake them. Any
trouble of the link or the disk becomes a state that every client sees, and ends by itself: the
worker connects again, with growing pauses, and settles what was under way.
"""

from __future__ import annotations

import logging
import math
import queue
import random
import threading
import time
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from rig.daemon.lease import ControlError
from rig.daemon.rpc import error_to_data, known
from rig.daemon.stopper import Stopper
from rig.errors import InputError, RigError, SessionError
from rig.link.refusals import DeviceRefusedError
from rig.ports import is_simulated
from rig.reasons import make_error, make_reason, remedies
from rig.recorder.controller import Controller
from rig.recorder.interrupts import StoppedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from rig.daemon.lease import Lease
    from rig.reasons import Reason
    from rig.recorder.published import PublishedState

log = logging.getLogger(__name__)
_ARMED_S = 0.08  # between two requests while armed: the device gives the host 250 ms
_WATCHED_S = 0.15  # between two looks at the gates
_ALONE_S = 1.0  # when nobody looks: often enough to see that the cable is out
_PING_S = 0.37  # mean distance of clock samples while a session is open
_COMMIT_S = 5.0  # so much of the idle talk may be lost with the power
_STATISTICS_S = 1.0
_FIRST_PAUSE_S, _LONGEST_PAUSE_S, _GROWTH = 0.25, 5.0, 1.6
STALL_S = 1.0
"""Held up for longer, the worker is said to be: nothing is known of the board meanwhile."""
_WAITING = make_reason("records_waiting")


class _Job(NamedTuple):
    work: Callable[[], Any]
    outcome: Future[Any]


class Worker:
    """Carries out what clients ask for.

    Parameters
    ----------
    url
        The port.
    published
        Where everything is shown.
    lease
        Who may keep a drop armed.

    Attributes
    ----------
    controller
        Used by the worker's own thread only.
    died
        Called, in that thread, with what it did not survive.
    """

    def __init__(self, url: str, published: PublishedState, lease: Lease) -> None:
        self.published = published
        self._url = url
        self._lease = lease
        self._jobs: queue.SimpleQueue[_Job | None] = queue.SimpleQueue()
        self._stop = ""  # why everything shall be off
        self._stops: list[Future[None]] = []
        self._guard = threading.Lock()  # of the two above
        self._holder: object = None  # who armed
        self._at_work = False  # for a client
        self._ending = False
        self._due_s = math.inf  # not begun
        self._uneven = random.Random()
        self._pause_s = _FIRST_PAUSE_S
        self._trouble: RigError | None = None
        self._troubled: object = None  # the session that was open then
        self._retry_at = 0.0
        self._looked_at = self._next_ping = self._next_commit = self._next_statistics = 0.0
        self.died: Callable[[BaseException], None] = lambda _: None
        self.controller = Controller(url, published=published, halted=self._halted, keep_port=True)
        self._stopper = Stopper(self.controller.stop_past)
        self._thread = threading.Thread(target=self._run, name="rig worker")

    # ------------------------------------------------------------------ from other threads

    def start(self) -> None:
        """Begin to work."""
        self._stopper.start()
        self._thread.start()

    def submit(
        self, work: Callable[[Controller], Any], holder: object, *, writes: bool = True
    ) -> Future[Any]:
        """Have something done, when what was asked for before is done.

        Parameters
        ----------
        work
            Called with the controller, in the worker's thread.
        holder
            The client that must be in control at that moment.
        writes
            Whether it makes no sense while the session file cannot be written.
        """
        outcome: Future[Any] = Future()

        def controlled() -> Any:
            self._lease.require(holder)
            self._holder = holder
            if writes and isinstance(self._trouble, SessionError):
                raise self._trouble
            return work(self.controller)

        self._jobs.put(_Job(controlled, outcome))
        return outcome

    def stop(self, reason: str) -> Future[None]:
        """Have everything switched off, before anything else is done."""
        outcome: Future[None] = Future()
        with self._guard:
            self._stop = self._stop or reason
            self._stops.append(outcome)
        self._stopper.ask()
        self._jobs.put(None)
        return outcome

    def lost(self) -> None:
        """Note that the client in control is gone: look at once whether a drop is armed."""
        self._jobs.put(None)

    def disk_s(self) -> float:
        """How long the disk has been at the write under way, s; 0 for none."""
        with suppress(SessionError):
            return self.controller.session.write_s
        return 0.0

    def stalled(self) -> RigError | None:
        """Say that nothing is known of the board, when the worker has been held up for long."""
        late_s, recorder = time.monotonic() - self._due_s, self.controller.recorder
        disk = self.disk_s() > 0.0
        # Without a board there is nothing to know; a simulated one may take long to be made.
        watched = disk or (recorder is not None and not is_simulated(self._url))
        if late_s < STALL_S or not watched:
            return None
        is_armed = recorder is not None and recorder.armed is not None
        disk_codes, worker_codes = ("disk_slow", "disk_slow_armed"), ("held_up", "held_up_armed")
        code = (disk_codes if disk else worker_codes)[is_armed]
        return make_error(SessionError, code, late_s=late_s)

    def at_rest(self) -> Future[bool]:
        """Find out whether nothing is lost when this ends now: nothing armed, falling, unsaved."""
        outcome: Future[bool] = Future()
        self._jobs.put(_Job(lambda: not self.controller.unsaved(), outcome))
        return outcome

    def end(self) -> None:
        """Finish: what is armed is disarmed, what is being recorded is recorded to its end."""
        self._ending = True
        self._jobs.put(None)

    def join(self) -> None:
        """Wait for the end."""
        self._thread.join()
        self._stopper.end()

    # ------------------------------------------------------------------ the thread

    def _halted(self) -> bool:
        """Whether what is under way shall end: asked by the recorder, many times a second."""
        self._beat()
        if self._stop:
            return True
        recorder = self.controller.recorder
        armed = recorder is not None and recorder.armed is not None
        asked = self._at_work and not self.controller.due
        return (self._ending or not self._held) and (armed or asked)

    def _beat(self, patience_s: float = 0.0) -> None:
        """Note that the thread goes on, and when it will at the latest have gone on again."""
        self._due_s = time.monotonic() + patience_s

    @property
    def _held(self) -> bool:
        return self._holder is not None and self._lease.holder is self._holder

    def _run(self) -> None:
        try:
            self._work()
        except BaseException as error:
            self._drain(known(RuntimeError("the worker died")))
            self.died(error)

    def _work(self) -> None:
        if not is_simulated(self._url):
            self._trying(self.controller.connect)
        while not self._ending:
            patience_s = self._patience()
            self._beat(patience_s)
            job = None
            with suppress(queue.Empty):
                job = self._jobs.get(timeout=patience_s)
            self._beat()
            self._turn(job)
        self._stop = self._stop or "the daemon ended"
        self._attend()
        self._drain(make_error(StoppedError, "daemon_ends"))
        self._trying(self.controller.close)
        self._due_s = math.inf

    def _turn(self, job: _Job | None) -> None:
        """Do what was asked for, then whatever is due."""
        self._do(job)
        self._attend()
        self._trying(self.controller.finish)
        self._trying(self.controller.notice)
        self._idle()

    def _do(self, job: _Job | None) -> None:
        if job is None or not job.outcome.set_running_or_notify_cancel():
            return  # somebody only wants to be heard, or nobody waits any more
        if self._stop:
            job.outcome.set_exception(self._stopped())
            return
        self._at_work = True
        try:
            result = job.work()
        except Exception as error:
            failure = known(error)
            # First what follows for the link, so that a client sees it before its answer.
            if self._trouble is None:
                self._weigh(failure)
            stopped = isinstance(error, StoppedError | DeviceRefusedError) and self._stop
            job.outcome.set_exception(self._stopped() if stopped else failure)
        else:
            if self._trouble is not None and self._over():
                self._well()
            job.outcome.set_result(result)
        finally:
            self._at_work = False

    def _over(self) -> bool:
        """Whether what was asked for has ended the trouble, by the way."""
        if isinstance(self._trouble, SessionError):
            return self._troubled is not self._open_session
        return self.controller.recorder is not None

    @property
    def _open_session(self) -> object:
        return self.controller.session if self.controller.recording else None

    def _stopped(self) -> StoppedError:
        return make_error(StoppedError, "stopped", text=self._stop)

    def _drain(self, error: RigError) -> None:
        with suppress(queue.Empty):
            while True:
                job = self._jobs.get_nowait()
                if job is not None and job.outcome.set_running_or_notify_cancel():
                    job.outcome.set_exception(error)

    def _attend(self) -> None:
        """Switch off what must not stay on."""
        recorder = self.controller.recorder
        armed = recorder is not None and recorder.armed is not None
        self._beat()
        with self._guard:
            reason, stops = self._stop, [*self._stops]  # one that comes from here on is not lost
        why: Reason | str = reason
        if reason:
            self._drain(make_error(StoppedError, "stopped", text=reason))
        elif armed and not self._held:
            silence = self._lease.silence(self._holder)
            client = {"client": self._lease.name, "silence_s": silence} if silence else {}
            why = make_reason("client_silent" if silence else "client_lost", **client)
        if why:
            self._stopper.taken_over()
            self._trying(partial(self.controller.stop, why))
        with self._guard:
            self._stops = [one for one in self._stops if one not in stops]
            if not self._stops:
                self._stop = ""
        for outcome in stops:
            outcome.set_result(None)

    # ------------------------------------------------------------------ between requests

    def _patience(self) -> float:
        """How long nothing needs to be done, s."""
        if self._stop:
            return 0.0
        moments = [time.monotonic() + _ALONE_S]
        if self._trouble is not None:
            moments.append(self._retry_at)
        elif self.controller.recorder is not None:
            moments.append(self._looked_at + self._look_s)
            if self.controller.recording:
                moments.append(self._next_ping)
            if self.published.watched:
                moments.append(self._next_statistics)
        return max(0.0, min(moments) - time.monotonic())

    def _idle(self) -> None:
        now = time.monotonic()
        recorder = self.controller.recorder
        if self._trouble is not None:
            if now >= self._retry_at:
                self._trying(self._recover)
            return
        if recorder is None:
            if not is_simulated(self._url):
                self._trying(self.controller.connect)
            return
        if now >= self._looked_at + self._look_s:
            self._looked_at = now
            self._trying(recorder.look)
        if self.controller.recording and recorder.armed is None and now >= self._next_ping:
            self._next_ping = now + _PING_S * self._uneven.uniform(0.5, 1.5)
            self._trying(recorder.ping)
        if self.controller.recording and recorder.armed is None and now >= self._next_commit:
            self._next_commit = now + _COMMIT_S
            self._trying(self.controller.session.commit)
        if self.published.watched and now >= self._next_statistics:
            self._next_statistics = now + _STATISTICS_S
            self._trying(self._statistics)

    @property
    def _look_s(self) -> float:
        """Time between two looks at the device."""
        if self.controller.recorder is not None and self.controller.recorder.armed is not None:
            return _ARMED_S
        return _WATCHED_S if self.published.watched else _ALONE_S

    def _statistics(self) -> None:
        recorder = self.controller.recorder
        if recorder is None:
            return
        pending = self.controller.session.pending if self.controller.recording else 0
        self.published.set(
            statistics=recorder.statistics()
            | {"uncommitted": pending, "commands_waiting": self._jobs.qsize()}
        )

    # ------------------------------------------------------------------ trouble

    def _trying(self, work: Callable[[], object]) -> None:
        """Do something of the worker's own; what goes wrong is everybody's to see."""
        try:
            work()
        except Exception as error:
            self._weigh(known(error))

    def _weigh(self, error: RigError) -> None:
        """Decide what an error means for the link."""
        if isinstance(error, SessionError) and self.controller.recording:
            waiting = self.controller.session.pending
            if waiting and _WAITING not in error.reasons:
                error.reasons += (_WAITING,)
                error.hint = "; ".join(remedies(error.reasons))
        if isinstance(error, DeviceRefusedError | StoppedError | ControlError | InputError):
            return
        if isinstance(error, SessionError):
            if not self.controller.recording:
                return  # of a file that is not, or no longer, open
            recorder = self.controller.recorder
            if recorder is not None and recorder.armed is not None:
                with suppress(RigError):
                    recorder.abort()
        else:
            with suppress(RigError):
                self.controller.disconnect()
            if is_simulated(self._url) and not self.controller.recording:
                return  # there is no scene, so there is no port to come back to
        if self._trouble is None:
            self._pause_s = _FIRST_PAUSE_S
        if str(self._trouble) != str(error):  # said once, however often it is tried again
            what = "trouble" if isinstance(error, SessionError) else "down"
            log.warning("%s: %s%s", what, error.message, f" ({error.hint})" if error.hint else "")
        self._trouble, self._troubled = error, self._open_session
        self._retry_at = time.monotonic() + self._pause_s
        up = self.controller.recorder is not None
        self.published.set(
            link={
                "state": "up" if up else "down",
                "error": None if up else error_to_data(error),
                "retry_s": self._pause_s,
            },
            phase="trouble",
            error=error_to_data(error),
            statistics=None,
        )
        self._pause_s = min(self._pause_s * _GROWTH, _LONGEST_PAUSE_S)

    def _recover(self) -> None:
        if self.controller.recording:
            self.controller.session.commit()  # what waits in memory since the disk was full
        self.controller.connect()
        if self.controller.recording:
            self.controller.settle()
        self._well()

    def _well(self) -> None:
        self._trouble = self._troubled = None
        self.published.set(error=None, phase="idle")
