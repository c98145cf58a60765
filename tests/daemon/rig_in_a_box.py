"""A whole rig in one thread and in virtual time: the daemon's worker, a file, a board, two clients.

All parts are the real ones; only threads, sockets and the computer's clock are not there. What goes
wrong does so at a chosen moment: when so many bytes have been written, or so many rows kept.
"""

import sqlite3
from contextlib import closing, suppress
from dataclasses import dataclass
from types import SimpleNamespace

from serial import SerialException

from bench.process_fixture import FENCE
from rig.daemon import worker as worker_module
from rig.daemon.lease import LEASE_S, Lease
from rig.daemon.worker import Worker
from rig.errors import RigError, SessionError
from rig.link.messages import Phase, pack_label, unpack_label
from rig.recorder import recorder as recorder_module
from rig.recorder.published import PublishedState
from rig.session import store
from rig.session.database import connect
from rig.session.journal import Journal
from rig.session.schema import RunState
from sim.board import VirtualBoard
from sim.clock import VirtualClock
from sim.serial_port import SimulatedSerial
from tests.link.bench import ScriptedLab, falling_rods

CHANGES = falling_rods(2)
RECORDING = Phase.RECORDING
LONGEST_S = 120.0
"""Of virtual time; what takes longer waits for ever."""
RECORDED = (RunState.RECORDED, RunState.ACCEPTED)


class KilledError(BaseException):
    """The daemon's process is gone, between two instructions."""


@dataclass(frozen=True)
class Trouble:
    """What goes wrong, and when: the n-th time that a point is passed from now on."""

    what: str
    point: str
    n: int = 1

    def __str__(self):
        return f"{self.what} at {self.point} {self.n}"


class Line(SimulatedSerial):
    """A port on whose way all points are counted."""

    def __init__(self, box):
        self.box = box
        super().__init__("a port", board=box.board, clock=box.clock, timeout=0.02, jitter_s=0.0)

    def write(self, data, /):
        self.box.passes("write")
        count = super().write(data)
        self.box.passes("written")
        return count

    def read(self, size=1, /):
        assert self.clock.now_ns() < self.box.until_ns, "it waits for ever"
        if self.box.line is not self:
            raise SerialException("device reports readiness to read but returned no data")
        data = super().read(size)
        return b"" if self.clock.now_ns() < self.box.deaf_until_ns else data


class Box:
    """The rig, from the moment at which a client has opened a session."""

    def __init__(self, folder, monkeypatch):
        self.protocol, self.session = folder / "fence.yaml", folder / "session"
        self.protocol.write_text(FENCE.replace("RUNS", "1"), "utf-8")
        self.clock = VirtualClock()
        self.fell: list[tuple[int, int]] = []
        self.board = VirtualBoard(ScriptedLab(changes=CHANGES))
        self.board.lab.drop = self.falls
        self.restart, self.board.reset = self.board.reset, self.restarted
        self.cut: set[tuple[int, int]] = set()  # fell while the board restarted: no record
        self.lease = Lease(self.now)
        self.line = None
        self.worker = None
        self.wanted = None  # what a client has asked to let go of, while it asks
        self.tokens: dict[int, tuple[int, int]] = {}
        self.trouble = None
        self.deaf_until_ns = self.until_ns = 0
        commit = Journal._commit

        def committed(journal):
            self.passes("commit", journal)
            commit(journal)
            self.passes("committed")

        def connected(path, *, readonly):
            # A killed process loses nothing that the kernel has, and no power fails here.
            connection = connect(path, readonly=readonly)
            connection.execute("PRAGMA synchronous = OFF")
            return connection

        monkeypatch.setattr(Journal, "_commit", committed)
        monkeypatch.setattr(store, "connect", connected)
        monkeypatch.setattr(recorder_module, "open_port", self.opened)
        monkeypatch.setattr(worker_module, "time", SimpleNamespace(monotonic=self.now))
        self.resume()

    # ------------------------------------------------------------------ parts

    def now(self):
        return self.clock.now_ns() * 1e-9

    def opened(self, _url):
        self.line = Line(self)
        return self.line

    def falls(self, label):
        """Let chains fall: the board calls this when it drives the release."""
        job = unpack_label(label)
        assert job == self.wanted, f"{job} fell, and {self.wanted} was asked for"
        assert job not in self.fell, f"{job} fell twice"
        assert self.on_disk("state", job)[-2:] == ["armed", "fired"], "not on the disk before"
        self.fell.append(job)
        return CHANGES

    def restarted(self, at_ns):
        """Restart the board, as each opening of its port does; what is not held yet is gone."""
        self.board.advance(at_ns)
        if self.board._controller.phase is Phase.RECORDING:
            self.cut.add(self.fell[-1])
        self.restart(at_ns)

    def on_disk(self, what, job):
        """Read what another process would see: only what is committed."""
        table = {"state": "run_state", "id": '"drop"'}[what]
        with closing(sqlite3.connect(self.session)) as other:
            sql = f"SELECT {what} FROM {table} WHERE run = ? AND attempt = ? ORDER BY id"
            return [one for (one,) in other.execute(sql, job)]

    def passes(self, point, journal=None):
        """Have what is to go wrong here go wrong."""
        trouble = self.trouble
        if trouble is None or trouble.point != point:
            return
        self.trouble = Trouble(trouble.what, point, trouble.n - 1) if trouble.n > 1 else None
        if self.trouble is None:
            getattr(self, trouble.what)(journal)

    def killed(self, _=None):
        raise KilledError

    def unplugged(self, _=None):
        self.line = None
        raise SerialException("device reports readiness to read but returned no data")

    def deafened(self, _=None):
        self.deaf_until_ns = self.clock.now_ns() + 200_000_000

    def stopped(self, _=None):
        self.worker.stop("a second client")

    def filled(self, journal):
        journal._connection.rollback()
        raise SessionError("the disk is full", "make room")

    # ------------------------------------------------------------------ what may be done

    def asked(self, work, client="A", *, writes=True):
        """Have a client ask for something; whether it was done, or not and why."""
        if self.worker is None:
            return None
        self.lease.heard(client)
        outcome = self.worker.submit(work, client, writes=writes)
        self.turned()
        if self.worker is None or not outcome.done():
            return None
        return outcome.result() if outcome.exception() is None else outcome.exception()

    def turned(self):
        """Let the worker do all that waits, then what is due."""
        self.until_ns = self.clock.now_ns() + round(LONGEST_S * 1e9)
        try:
            while not self.worker._jobs.empty():
                self.worker._turn(self.worker._jobs.get_nowait())
            self.worker._turn(None)
        except KilledError:
            self.kill()

    def kill(self):
        """End the daemon as ``kill -9`` does; what the kernel has of it goes its way."""
        self.clock.sleep(0.02)
        self.board.advance(self.clock.now_ns())
        session = self.worker.controller.opened
        if session is not None:
            session._connection.close()
            session._lock.release()
        self.lease = Lease(self.now)
        self.worker = self.line = None

    def passed(self, seconds, client="A"):
        """Let time pass, as the worker does; a client may be heard all the time."""
        end = self.now() + seconds
        while self.worker is not None and self.now() < end:
            if client:
                self.lease.heard(client)
            pause_s = min(end - self.now(), self.worker._patience(), LEASE_S / 4)
            self.clock.sleep(max(0.001, pause_s))
            self.turned()

    def resume(self):
        """Start a daemon where there is none, and go on with the session."""
        if self.worker is None:
            self.worker = Worker("a port", PublishedState(), self.lease)
        with suppress(RigError):
            self.lease.take("A", "A")
        names = str(self.protocol), str(self.session)
        return self.asked(lambda c: None if c.opened else c.open_session(*names))

    def coming(self):
        """Run and attempt that come next by the file; `None` when all are done."""
        with closing(sqlite3.connect(self.session)) as other:
            sql = "SELECT attempt, state FROM run_state WHERE run = 1 ORDER BY id"
            entries = other.execute(sql).fetchall()
        if entries and entries[-1][1] in ("accepted", "recorded"):
            return None
        return 1, entries[-1][0] + 1 if entries else 1

    def arm(self, client="A"):
        job = self.coming()
        if job is None:
            return None
        token = self.asked(lambda c: c.arm(*job), client)
        if isinstance(token, int):
            self.tokens[token] = job
        return token

    def fire(self, token, client="A"):
        self.wanted = self.tokens[token]
        answer = self.asked(lambda c: c.fire(token), client)
        self.wanted = None
        return answer

    def fire_latest(self):
        return self.fire([*self.tokens][-1]) if self.tokens else None

    def fire_first(self):
        return self.fire(next(iter(self.tokens))) if len(self.tokens) > 1 else None

    def accept(self):
        for job in self.fell:
            if self.on_disk("state", job)[-1:] == ["recorded"]:
                self.asked(lambda c, job=job: c.log_state(*job, RunState.ACCEPTED))

    def stop(self):
        outcome = self.worker.stop("a client")
        self.turned()
        if outcome.done() and self.worker is not None and self.worker._trouble is None:
            assert not self.board.outputs(), "on after STOP"
            assert self.phase is not Phase.ARMED, "armed after STOP"

    def wait(self):
        self.passed(0.4)

    def hang(self):
        """Have the worker held up: no byte leaves while time goes by."""
        self.clock.sleep(0.3)
        self.board.advance(self.clock.now_ns())
        self.turned() if self.worker is not None else None

    def silence(self):
        self.passed(1.1 * LEASE_S, client="")

    def other(self):
        """Have another client take over, when it may."""
        with suppress(RigError):
            self.lease.take("B", "B")
            self.turned()

    def reset(self):
        self.board.reset(self.clock.now_ns())
        self.turned() if self.worker is not None else None

    def pull(self):
        """Pull the cable and put it back: the open port is gone, and can be opened again."""
        self.line = None
        self.turned()

    # ------------------------------------------------------------------ what must be true

    def check(self):
        """See that no drop is lost, whatever has happened, and that the log is what is shown."""
        worker = self.worker
        if worker and worker.controller.opened and not worker._trouble:
            shown = worker.published.snapshot()["state"]
            line, drop = shown["runs"][0], shown["drop"]
            state = (self.on_disk("state", (1, line["attempt"])) or ["planned"])[-1]
            assert line["state"] == state, f"{line['state']} is shown, {state} is logged"
            if drop and state in {"interrupted", "recorded"}:
                assert drop["state"] == state, "the drop is shown as another"
        held = self.board._controller
        label = held.drop.order.label if held.drop is not None else None
        for job in self.fell:
            if label != pack_label(*job) and job not in self.cut and self.phase is not RECORDING:
                assert len(self.on_disk("id", job)) == 1, f"{job} is lost"
                assert set(self.on_disk("state", job)) & set(RECORDED), f"{job} is not told of"

    @property
    def phase(self):
        self.board.advance(self.clock.now_ns())
        return self.board._controller.phase

    def state(self):
        """Give what tells this moment from others; times and texts do not."""
        board = self.board._controller
        worker = self.worker
        rig = None
        if worker is not None:
            recorder, controller = worker.controller.recorder, worker.controller
            rig = (
                controller.opened is not None, recorder is not None, recorder and recorder.armed,
                controller.due, type(worker._trouble).__name__, self.lease.holder,
                worker._holder, self.line is not None,
            )  # fmt: skip
        log = [self.on_disk("state", (1, attempt))[-1:] for attempt in (1, 2)]
        held = board.drop is not None
        valid = [*self.tokens][-1] == board._token if self.tokens else None
        return rig, board.phase, held, self.board.outputs(), str(log), valid, len(self.tokens) > 1

    def enabled(self, action):
        """Whether an action can do anything now; that many cannot is most of the time saved."""
        match action:
            case "fire_latest":
                return bool(self.tokens) and self.worker is not None
            case "fire_first":
                return len(self.tokens) > 1 and self.worker is not None
            case "accept":
                return any(self.on_disk("state", one)[-1:] == ["recorded"] for one in self.fell)
            case "resume":
                return self.worker is None or self.worker.controller.opened is None
            case "reset":
                return True
        return self.worker is not None

    def ends_well(self):
        """Go on by what anybody would do, and see that all runs come to their end."""
        self.trouble, self.deaf_until_ns = None, 0
        if self.worker is not None:
            self.silence()
        for _ in range(12):
            with suppress(RigError):
                self.resume()
            self.passed(6.0 if self.worker._trouble else 0.1)
            self.check()
            self.accept()
            if self.coming() is None:
                break
            token = self.arm()
            if isinstance(token, int):
                self.fire(token)
        assert self.coming() is None, self.state()
        assert self.worker.published.get("error") is None
        self.check()
