"""The one thread that touches the port and the session file, and that keeps the link alive.

Clients' requests wait in a queue; STOP and the loss of whoever is in control overtake them. Any
trouble of the link or the disk becomes a state that every client sees, and ends by itself: the
worker connects again, with growing pauses, and settles what was under way.
"""

import logging
import math
import queue
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

from rig.daemon.lease import Lease
from rig.daemon.rpc import error_to_data, in_words
from rig.errors import ControlError, DeviceError, InputError, RigError, SessionError, StoppedError
from rig.link.refusals import DeviceRefusedError
from rig.ports import is_simulated
from rig.reasons import Reason, make_reason, remedies, rig_error
from rig.recorder.controller import Controller
from rig.recorder.published import PublishedState, link_state

log = logging.getLogger(__name__)
_ARMED_S = 0.08  # between two requests while armed: the device gives the host 250 ms
_WATCHED_S = 0.15  # between two looks at the gates
_ALONE_S = 1.0  # when nobody looks: often enough to see that the cable is out
_COMMIT_S = 5.0  # so much of the idle talk may be lost with the power
_STATISTICS_S = 1.0
_FIRST_PAUSE_S, _LONGEST_PAUSE_S, _GROWTH = 0.25, 5.0, 1.6
STALL_S = 1.0
"""Held up for longer, the worker is said to be: nothing is known of the board meanwhile."""
_ABORTS, _ABORT_S = 5, 0.03
"""As an ABORT of the worker is repeated: all within the 250 ms after which everything is off."""
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
    over
        Done when that thread has ended; what it did not survive is its exception.
    """

    def __init__(self, url: str, published: PublishedState, lease: Lease) -> None:
        self.published = published
        self._url = url
        self._lease = lease
        self._jobs: queue.SimpleQueue[_Job | None] = queue.SimpleQueue()
        self._stops: list[tuple[str, Future[None]]] = []  # why everything shall be off
        self._holder: object = None  # who armed
        self._at_work = False  # for a client
        self._ending = False
        self._due_s = math.inf  # not begun
        self._ping_s = 0.0  # until the next clock sample
        self._pause_s = _FIRST_PAUSE_S
        self._trouble: RigError | None = None
        self._begun: dict[str, float] = {}  # when each duty was done last
        self.over: Future[None] = Future()
        self.controller = Controller(url, published, self._is_halted)
        self._attended = threading.Event()  # to STOP, by the worker's own thread
        self._thread = threading.Thread(target=self._run, name="rig worker", daemon=True)

    # ------------------------------------------------------------------ from other threads

    def start(self) -> None:
        """Begin to work, unless it has begun."""
        if self._thread.ident is None:
            self._thread.start()

    def submit(self, do: Callable[..., Any], holder: object, *, writes: bool) -> Future[Any]:
        """Have something done, when what was asked for before is done.

        Parameters
        ----------
        do
            Called with the controller, in the worker's thread.
        holder
            The client that must be in control at that moment.
        writes
            Whether it makes no sense while the session file cannot be written.
        """

        def in_control() -> Any:
            self._lease.require(holder)
            self._holder = holder
            if writes and isinstance(self._trouble, SessionError):
                raise self._trouble
            return do(self.controller)

        outcome: Future[Any] = Future()
        self._jobs.put(_Job(in_control, outcome))
        return outcome

    def stop(self, reason: str) -> Future[None]:
        """Have everything switched off, before anything else is done."""
        outcome: Future[None] = Future()
        self._stops.append((reason, outcome))
        self._attended.clear()
        # A port that takes no bytes may hold this thread until the process ends.
        threading.Thread(target=self._send_aborts, name="rig stop", daemon=True).start()
        self.wake()
        return outcome

    def wake(self) -> None:
        """Look at once whether something is to be switched off: whoever armed it may be gone."""
        self._jobs.put(None)

    def disk_s(self) -> float:
        """How long the disk has been at the write under way, s; 0 for none."""
        session = self.controller.opened
        return 0.0 if session is None else session.write_s

    def stall(self) -> RigError | None:
        """Say that nothing is known of the board, when the worker has been held up for long."""
        late_s, recorder = time.monotonic() - self._due_s, self.controller.recorder
        disk = self.disk_s() > 0.0
        # Without a board there is nothing to know; a simulated one may take long to be made.
        watched = disk or (recorder is not None and not is_simulated(self._url))
        if late_s < STALL_S or not watched:
            return None
        codes = ("disk_slow", "disk_slow_armed") if disk else ("held_up", "held_up_armed")
        return rig_error(codes[bool(self.controller.armed)], late_s=late_s)

    def end(self) -> None:
        """Finish: what is armed is disarmed, what is being recorded is recorded to its end."""
        self._ending = True
        self.wake()

    def join(self) -> None:
        """Wait for the end."""
        self._thread.join()

    def _send_aborts(self) -> None:
        """Send ABORT at once, and again until the worker's own thread is at it.

        A thread of its own waits for no disk and for nothing that is under way.
        """
        for _ in range(_ABORTS):
            if not self._abort_past() or self._attended.wait(_ABORT_S):
                return

    def _abort_past(self) -> bool:
        """Send ABORT past the worker's own thread; `False` when nobody can hear it."""
        recorder = self.controller.recorder
        if recorder is None or is_simulated(self._url):  # a simulated board lives in one thread
            return False
        try:
            recorder.device.abort_past()
        except (DeviceError, OSError, TypeError):  # closed meanwhile, in whatever moment
            return False
        return True

    # ------------------------------------------------------------------ the thread

    def _is_halted(self) -> bool:
        """Whether what is under way shall end: asked by the recorder, many times a second."""
        self._beat()
        if self._stops:
            return True
        is_lost = self._ending or not self._held
        return is_lost and (self._at_work or self.controller.armed is not None)

    def _beat(self, patience_s: float = 0.0) -> None:
        """Note that the thread goes on, and when it will at the latest have gone on again."""
        self._due_s = time.monotonic() + patience_s

    @property
    def _held(self) -> bool:
        return self._holder is not None and self._lease.holder is self._holder

    def _run(self) -> None:
        try:
            self._work()
            self.over.set_result(None)
        except BaseException as error:
            self._drain(in_words(RuntimeError("the worker died")))
            self.over.set_exception(error)

    def _work(self) -> None:
        while not self._ending:
            patience_s = self._patience()
            self._beat(patience_s)
            job = None
            with suppress(queue.Empty):
                job = self._jobs.get(timeout=patience_s)
            self._beat()
            self._turn(job)
        self._stops.append(("the daemon ended", Future()))
        self._attend()
        self._drain(rig_error("daemon_ends"))
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
        if self._stops:
            job.outcome.set_exception(self._stop_error())
            return
        self._at_work = True
        try:
            result = job.work()
        except Exception as error:
            failure = in_words(error)
            # First what follows for the link, so that a client sees it before its answer.
            if self._trouble is None:
                self._weigh(failure)
            is_stopped = isinstance(error, StoppedError | DeviceRefusedError) and self._stops
            job.outcome.set_exception(self._stop_error() if is_stopped else failure)
        else:
            if self._trouble is not None and self._is_settled():
                self._trying(self._recover)  # what was asked for has ended it, by the way
            job.outcome.set_result(result)
        finally:
            self._at_work = False

    def _is_settled(self) -> bool:
        """Whether nothing is to be connected: there is a connection, or nothing that needs one."""
        controller = self.controller
        is_idle = controller.opened is None and is_simulated(self._url)
        return is_idle or controller.recorder is not None

    def _stop_error(self) -> RigError:
        return rig_error("stopped", text=self._stops[0][0])

    def _drain(self, error: RigError) -> None:
        with suppress(queue.Empty):
            while True:
                job = self._jobs.get_nowait()
                if job is not None and job.outcome.set_running_or_notify_cancel():
                    job.outcome.set_exception(error)

    def _attend(self) -> None:
        """Switch off what must not stay on."""
        self._beat()
        stops = [*self._stops]  # one that comes from here on is not lost
        why: Reason | str = ""
        if stops:
            why = stops[0][0]
            self._drain(self._stop_error())
        elif self.controller.armed is not None and not self._held:
            silence = self._lease.silence(self._holder)
            client = {"client": self._lease.name, "silence_s": silence} if silence else {}
            why = make_reason("client_silent" if silence else "client_lost", **client)
        if why:
            self._attended.set()
            self._trying(partial(self.controller.stop, why))
        del self._stops[: len(stops)]
        for _, outcome in stops:
            outcome.set_result(None)

    # ------------------------------------------------------------------ between requests

    def _duties(self) -> Iterator[tuple[Callable[[], object], float]]:
        """List what is to be done again and again as things stand, and how often, s."""
        controller, recorder = self.controller, self.controller.recorder
        watched = self.published.watched
        if self._trouble is not None:
            yield self._recover, self._pause_s
        elif recorder is not None and (watched or not is_simulated(self._url)):
            is_armed = recorder.armed is not None
            yield recorder.look, _ARMED_S if is_armed else _WATCHED_S if watched else _ALONE_S
            if controller.opened is not None and not is_armed:
                yield self._ping, self._ping_s
                yield controller.opened.commit, _COMMIT_S
            if watched:
                yield self._statistics, _STATISTICS_S
        elif recorder is None and not is_simulated(self._url):
            yield controller.connect, _ALONE_S

    def _due_at(self, duty: Callable[[], object], period_s: float) -> float:
        return self._begun.get(duty.__name__, 0.0) + period_s

    def _patience(self) -> float:
        """How long nothing needs to be done, s."""
        now = time.monotonic()
        moments = [self._due_at(*duty) for duty in self._duties()]
        return 0.0 if self._stops else max(0.0, min([now + _ALONE_S, *moments]) - now)

    def _idle(self) -> None:
        now = time.monotonic()
        for duty, period_s in [*self._duties()]:
            if now >= self._due_at(duty, period_s):
                self._begun[duty.__name__] = now
                self._trying(duty)

    def _ping(self) -> None:
        if (recorder := self.controller.recorder) is not None:
            self._ping_s = recorder.ping_gap_s()
            recorder.ping()

    def _statistics(self) -> None:
        if (recorder := self.controller.recorder) is not None:
            pending = self.controller.opened.pending if self.controller.opened else 0
            more = {"uncommitted": pending, "commands_waiting": self._jobs.qsize()}
            self.published.set(statistics=recorder.statistics() | more)

    # ------------------------------------------------------------------ trouble

    def _trying(self, work: Callable[[], object]) -> None:
        """Do something of the worker's own; what goes wrong is everybody's to see."""
        try:
            work()
        except Exception as error:
            self._weigh(in_words(error))

    def _weigh(self, error: RigError) -> None:
        """Decide what an error means for the link."""
        controller = self.controller
        if isinstance(error, DeviceRefusedError | StoppedError | ControlError | InputError):
            return
        if isinstance(error, SessionError):
            if controller.opened is None:
                return  # of a file that is not, or no longer, open
            if controller.opened.pending and _WAITING not in error.reasons:
                error.reasons += (_WAITING,)
                error.hint = "; ".join(remedies(error.reasons))
            if controller.recorder is not None and controller.armed is not None:
                with suppress(RigError):
                    controller.recorder.abort()
        else:
            with suppress(RigError):
                controller.disconnect()
            if is_simulated(self._url) and controller.opened is None:
                return  # there is no scene, so there is no port to come back to
        longer_s = min(self._pause_s * _GROWTH, _LONGEST_PAUSE_S)
        self._pause_s = _FIRST_PAUSE_S if self._trouble is None else longer_s
        self._begun[self._recover.__name__] = time.monotonic()
        if str(self._trouble) != str(error):  # said once, however often it is tried again
            what = "trouble" if isinstance(error, SessionError) else "down"
            log.warning("%s: %s%s", what, error.message, f" ({error.hint})" if error.hint else "")
        self._trouble = error
        is_up, data = controller.recorder is not None, error_to_data(error)
        link = link_state("up" if is_up else "down", None if is_up else data, self._pause_s)
        self.published.set(link=link, error=data, statistics=None)

    def _recover(self) -> None:
        if self.controller.opened is not None:
            self.controller.opened.commit()  # what waits in memory since the disk was full
        if not self._is_settled():
            self.controller.connect()
        if self.controller.opened is not None:
            self.controller.settle()
        self._trouble = None
        self.published.set(error=None)
