"""The life of sessions as clients have it: each answer, each change, and what stays in the file."""

import json
from dataclasses import replace
from zlib import crc32

from bench.process_fixture import FENCE
from rig.daemon.connecting import connect
from rig.daemon.service import METHODS
from rig.daemon.worker import Worker
from rig.errors import InputError, SessionError, StoppedError
from rig.reasons import plain_reason, rig_error
from rig.recorder.interrupts import Interrupts
from rig.recorder.published import PublishedState
from rig.session.schema import RunState
from rig.session.store import Session
from tests.daemon.rig_in_a_box import CHANGES, Box, Trouble
from tests.refusals import refused
from tests.tables import read_table

LEFT_OUT = {"created", "hint", "reason_codes"}
"""What differs from time to time, or is said in fewer words beside it."""


class Told(Box):
    """A rig whose worker has no session yet, with all that it has told since it was asked last."""

    is_absent = False

    def __init__(self, folder, monkeypatch):
        super().__init__(folder, monkeypatch)
        self.kill()
        (folder / "blind.yaml").write_text(FENCE.replace("RUNS", "2") + "blind: true\n", "utf-8")
        self.folder, self.changes, published = folder, [], PublishedState()
        published.changed = lambda: self.changes.append(published.take())
        # What leaves from a thread of its own leaves at no certain time.
        monkeypatch.setattr(Worker, "_abort_past", lambda _worker: False)
        self.worker = Worker("a port", published, self.lease)
        self.lease.take("A", "A")
        # An event of two edges, and how long a test of the release looks behind its pulse.
        more = [(0.07, 0, True), (0.07, 1, True), (0.579, 0, False), (0.5805, 1, False)]
        self.board.lab.drop = lambda _label: [*CHANGES, *more]

    def opened(self, url):
        if self.is_absent:
            raise rig_error("no_port", port=url, text="gone")
        return super().opened(url)

    def watch(self, watched):
        self.worker.published.watched = watched

    def unplug(self, absent):
        self.is_absent = absent
        self.pull()

    def kept(self, name):
        """Count what a session file holds, and give the CRC-32 of all bytes with their times."""
        with Session.open(self.folder / name, readonly=True) as session:
            kept = [*session.byte_log()], session.pings(), session.states(), [*session.drops()]
            counts = [len(session.identities()), *map(len, kept)]
        return {"rows": counts, "crc": crc32(repr(kept[:2]).encode())}

    def swap(self, number):
        """Have another board at the port."""
        self.board.identity = replace(self.board.identity, unique_id=bytes([number]) * 8)
        self.pull()

    def goes_wrong(self, *trouble):
        self.trouble = Trouble(*trouble)

    def do(self, deed, values):
        """Do what somebody's hand does (values in a list), or a client asks for; what is told."""
        self.changes.clear()
        if isinstance(values, list):
            hand = getattr(self, deed, None) or getattr(self.board, deed)
            answer = hand(*values)
        else:
            names = {"protocol", "session"} & values.keys()
            files = {name: str(self.folder / values[name]) for name in names}
            method = METHODS[deed]
            answer = self.asked(method.bind(values | files), writes=method.writes)
        told = str(answer) if isinstance(answer, Exception) else ""
        text = json.dumps([answer if isinstance(answer, dict) else told, *self.changes]).replace(
            f"{self.folder}/", ""
        )
        short = lambda one: {key: one[key] for key in one if key not in LEFT_OUT}  # noqa: E731
        return json.loads(text, object_hook=short)


def test_each_deed_has_its_answer_its_changes_and_its_lines_of_the_log(
    tmp_path, monkeypatch, caplog
):
    caplog.set_level("INFO")
    rig = Told(tmp_path, monkeypatch)
    for deed, values, *told in read_table(__file__, "life"):
        caplog.clear()
        came = rig.do(deed, values)
        said = [line.replace(f"{tmp_path}/", "") for line in caplog.messages]
        assert came + said == told, (deed, values)
    rig.kill()


def test_a_client_finds_in_the_file_what_it_has_asked_for(tmp_path, monkeypatch):
    """Of a worker of its own, where no daemon is."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    protocol = tmp_path / "fence.yaml"
    protocol.write_text(FENCE.replace("RUNS", "2"), "utf-8")
    client = connect("sim://", print, Interrupts())
    assert client.open_session(str(protocol), str(tmp_path / "session"), 3) is None
    session = client.session
    client.wait(2.0)
    assert 4 <= len(session.pings()) <= 12
    token = client.arm(1, 1)
    client.stop("enough")
    refused(StoppedError, "enough", client.fire, token)
    client.fire(client.arm(1, 2))
    assert client.collect(1, 2) == session.drop(1, 2) == next(session.drops())
    client.log_state(1, 2, RunState.VOID, (plain_reason("skew"),))
    refused(InputError, "there is no record of run 2, attempt 1", client.collect, 2, 1)
    course = ["armed", "interrupted", "armed", "fired", "recorded", "void"]
    assert [entry.state for entry in session.states()] == course
    assert session.states()[-1].reasons == (plain_reason("skew"),)
    client.close_session()
    refused(SessionError, "no session is open", getattr, client, "session")
    refused(SessionError, "closed", session.pings)
    Session.open(tmp_path / "session").close()
    client.close()
