"""What clients can ask for, carried out on one port and one session file by one thread."""

import logging
from pathlib import Path
from typing import Any

from rig.errors import InputError, RigError, StoppedError
from rig.link.exchange import Halted
from rig.link.messages import TEST_RUN, Identity, RefusalReason
from rig.link.port import Port
from rig.link.refusals import DeviceRefusedError
from rig.ports import fill_url, is_simulated, truth_file
from rig.protocol import reader
from rig.protocol.measurable import check_gates, check_recordable
from rig.protocol.protocol import Protocol
from rig.reasons import Reason, error_of, make_reason, plain_reason, rig_error
from rig.recorder import release_test
from rig.recorder.board_locator import SERIAL_NUMBER, BoardLocator
from rig.recorder.opening import describe_session, latest_board, open_for
from rig.recorder.published import PublishedState, link_state
from rig.recorder.recorder import NullSink, Recorder
from rig.records import Drop, Job
from rig.session.schema import VERDICTS, Reasons, RunState
from rig.session.store import Session

log = logging.getLogger(__name__)


class Controller:
    """The one place where sessions are opened and drops are made.

    Parameters
    ----------
    url
        The port, as the user named it.
    published
        Where everything is shown.
    halted
        As for `Recorder`.

    Attributes
    ----------
    recorder
        Connected, or `None`.
    opened
        The open session, or `None`.
    due
        Run and attempt of a drop that fell and was not collected yet.
    """

    def __init__(self, url: str, published: PublishedState, halted: Halted = lambda: False) -> None:
        self.url = url
        self.published = published
        self.recorder: Recorder | None = None
        self.due: Job | None = None
        self._halted = halted
        self._keep_port = not is_simulated(url)  # between sessions
        self.opened: Session | None = None
        self._protocol: Protocol | None = None
        self._line_url = url  # with all that a simulation is told
        self._locator = BoardLocator(url)
        self._unarmed: RigError | None = None  # why what was armed is not
        self._lost: dict[Job, RigError] = {}  # why a drop is not in the session

    # ------------------------------------------------------------------ sessions

    @property
    def session(self) -> Session:
        """The open session, which there must be.

        Raises
        ------
        SessionError
            There is none.
        """
        if self.opened is None:
            raise rig_error("no_session_open")
        return self.opened

    @property
    def armed(self) -> Job | None:
        """Run and attempt of the drop that waits for `fire`."""
        return None if self.recorder is None else self.recorder.armed

    def open_session(self, protocol: str, session: str, seed: int | None = None) -> Job | None:
        """Make a session or go on with one, connect, and settle what was left behind.

        Parameters
        ----------
        protocol, session
            Files.
        seed
            Of a simulation.

        Returns
        -------
        Job or None
            Of a drop that was fetched from the device.

        Raises
        ------
        InputError, SessionError
            Protocol or session cannot be used.
        DeviceError
            The device is in trouble, or holds a drop of another session.
        """
        source, path = Path(protocol), Path(session)
        scene = reader.read(protocol)
        check_gates(scene)
        fresh = fill_url(self.url, source, path, seed)
        self.close_session()
        is_new = not path.exists()
        opened = self.opened = open_for(scene, source, fresh, path)
        self._protocol = scene
        try:
            before = latest_board(opened)
            self._line_url = fill_url(self.url, source, path, seed, before.get("port", ""))
            self._locator.seek(before.get(SERIAL_NUMBER))
            check_recordable(scene, self.connect().capabilities())
            self._locator.bound = True
            fetched = self.settle()
        except BaseException as error:
            # With other input it would be another protocol's, or of another kind of port: in the
            # way of the next try, and where no byte went over the line there is nothing in it.
            empty = is_new and (isinstance(error, InputError) or not any(opened.byte_log()))
            try:
                self.close_session()
            finally:
                if empty:
                    for file in (path, truth_file(path)):
                        file.unlink(missing_ok=True)
            raise
        about, plan = describe_session(opened, scene)
        log.info("session: %s", path)
        self.published.plan(plan)
        self.published.set(session=about, drop=None, release_test=None)
        self.published.replace_edges(())  # of a drop that was fetched
        return fetched

    def unblind(self) -> None:
        """Record that the session's numbers may be seen from now on.

        Raises
        ------
        SessionError
            None is open, that was recorded before, or the disk fails.
        """
        self.session.unblind()
        self.published.set(session=self.published.get("session") | {"blind": False})

    def close_session(self) -> None:
        """Make safe and close the file, whole; a port that shall stay open does."""
        session, self.opened, self._protocol = self.opened, None, None
        if session is None:
            return
        log.info("closed: %s", session.path)
        self._locator.bound = False
        self._lost.clear()
        recorder, self.recorder, self.due = self.recorder, None, None
        port = None
        try:
            if recorder is not None:
                port = recorder.let_go(keep=self._keep_port)
        finally:
            session.close()
            self.published.plan(())
            self.published.set(session=None, drop=None, link=link_state("closed"))
        if port is not None:
            self.connect(port)

    # ------------------------------------------------------------------ the link

    def connect(self, port: Port | None = None) -> Identity:
        """Connect, with the port that is open already if there is one.

        Raises
        ------
        DeviceError
            No such port, nobody there, another protocol version, another board than the session's.
        """
        if port is None and self.recorder is not None:
            port = self.recorder.let_go(keep=True)
        self.recorder = None
        self.published.set(link=link_state("opening"))
        url = self._line_url
        if not is_simulated(url):
            url = self._locator.path if port is not None else self._locator.look()
        sink = NullSink() if self.opened is None else self.opened
        published, meet = self.published, self._locator.meet
        self.recorder = Recorder(sink, url, published, self._halted, meet, port)
        place = {"url": self.url, "simulated": is_simulated(url), "path": self._locator.path}
        published.set(port=place, link=link_state("up"), phase="idle")
        identity = self.recorder.identity
        if port is None:
            log.info("up: %s, id %s", identity.board, identity.unique_id.hex())
        return identity

    def disconnect(self) -> None:
        """Let go of a port that fails."""
        recorder, self.recorder, self.due = self.recorder, None, None
        if recorder is not None:
            recorder.let_go()

    def settle(self) -> Job | None:
        """Settle what an earlier connection left: a drop the device holds, a run without a record.

        Returns
        -------
        Job or None
            Of the drop that was fetched.

        Raises
        ------
        DeviceError
            The device holds a drop of another session, or is in trouble.
        """
        recorder = self._require_recorder()
        held = recorder.device.status().drop
        if held is not None and held.run == TEST_RUN:
            release_test.forget(recorder)
            held = None
        if held is not None:
            if held not in self.session.fired_ns():
                raise rig_error("drop_of_another_session", **held._asdict())
            recorder.collect(held, fresh=False)
            self._lost.pop(held, None)
        latest = {entry.run: entry for entry in self.session.states()}
        for run, attempt, state, _, reasons in latest.values():
            job = Job(run, attempt)
            if state in {RunState.ARMED, RunState.FIRED} and self.session.drop(*job) is None:
                recorder.state(job, RunState.INTERRUPTED, (make_reason("connection_ended"),))
            else:  # a disk that was full may have taken it since
                recorder.feed.state(job, state, reasons)
        return held

    # ------------------------------------------------------------------ drops

    def wait(self, seconds: float) -> None:
        """Let time pass, see `Recorder.wait`."""
        self._require_recorder().wait(seconds)

    def arm(self, run: int, attempt: int) -> int:
        """Prepare a drop.

        Returns
        -------
        int
            The token for `fire`.

        Raises
        ------
        InputError
            Not of the plan, or not the attempt that comes next: no drop is made twice.
        DeviceRefusedError
            As for `Recorder.arm`.
        """
        recorder, protocol = self._require_rest("arm")
        last = self.session.latest_state(run)
        planned = self.published.get("session")["planned"]
        if not 1 <= run <= planned or attempt != (last.attempt if last else 0) + 1:
            raise rig_error("not_next", run=run, attempt=attempt)
        self.session.require_presence()
        self._unarmed = None
        return recorder.arm(Job(run, attempt), protocol)

    def notice(self) -> None:
        """Log that the device has disarmed itself, when it has."""
        recorder = self.recorder
        reason = recorder.device.transcript.disarmed if recorder and recorder.armed else None
        if reason is not None:
            refusal = DeviceRefusedError(RefusalReason.NOT_ARMED, 0, reason)
            self.stop(*refusal.reasons)
            self._unarmed = refusal

    def fire(self, token: int) -> None:
        """Let go. From here on the drop is collected whatever happens: call `finish`.

        Raises
        ------
        DeviceRefusedError
            As for `Recorder.fire`.
        """
        recorder = self._require_recorder()
        armed = recorder.armed
        if armed is None:
            raise self._unarmed or rig_error("nothing_armed")
        try:
            recorder.fire(token)
        finally:
            if recorder.armed is None:
                self.due = armed

    def finish(self) -> None:
        """Collect the drop that fell, store it, and let the device forget it.

        Raises
        ------
        RigError
            It could not be read or stored: the device still has it.
        """
        due, self.due = self.due, None
        if due is None:
            return
        try:
            self._require_recorder().collect(due)
        except RigError as error:
            self._lost[due] = error
            raise

    def collect(self, run: int, attempt: int) -> Drop:
        """Return a drop that fell, once it is in the session.

        Raises
        ------
        RigError
            Why it is not.
        """
        self.finish()
        drop = self.session.drop(run, attempt)
        if drop is None:
            missing = rig_error("not_recorded", run=run, attempt=attempt)
            raise self._lost.get(Job(run, attempt)) or missing
        return drop

    def test_release(self) -> dict[str, Any]:
        """Drive the release once with nothing hung, see `rig.recorder.release_test.drive`.

        Raises
        ------
        InputError
            No session is open, or a drop is under way.
        """
        recorder, protocol = self._require_rest("test the release")
        self.published.set(release_test=None)
        result = release_test.drive(recorder, protocol, self._halted)
        self.published.set(release_test=result)
        return result

    def log_state(self, run: int, attempt: int, state: RunState, reasons: Reasons = ()) -> None:
        """Log a verdict on a recorded drop.

        Raises
        ------
        InputError
            No such drop, or no verdict.
        """
        last, drop = self.session.latest_state(run), self.session.drop(run, attempt)
        if last is None or drop is None or last.attempt != attempt or state not in VERDICTS:
            raise rig_error("cannot_judge", run=run, attempt=attempt, state=state)
        if (last.state, last.reasons) != (state, reasons):
            self._require_recorder().state(Job(run, attempt), state, reasons)
            self.session.settle()

    def stop(self, reason: Reason | str) -> None:
        """Switch everything off; log an armed drop as interrupted, a text as somebody's words.

        Raises
        ------
        DeviceError
            The device does not answer: it disarms itself.
        """
        recorder = self.recorder
        if recorder is None:
            return
        armed = recorder.armed
        why = plain_reason(reason, "stopped") if isinstance(reason, str) else reason
        self._unarmed = error_of(StoppedError, why)
        try:
            recorder.abort()
        finally:
            if armed is not None:
                recorder.state(armed, RunState.INTERRUPTED, (why,))

    def close(self) -> None:
        """Close session and port."""
        self._keep_port = False
        try:
            self.close_session()
        finally:
            self.disconnect()

    def _require_recorder(self) -> Recorder:
        if self.recorder is None:
            raise rig_error("no_connection")
        return self.recorder

    def _require_rest(self, act: str) -> tuple[Recorder, Protocol]:
        recorder, protocol = self._require_recorder(), self._protocol
        if protocol is None or recorder.armed or self.due:
            raise rig_error("not_now", act=act)
        return recorder, protocol
