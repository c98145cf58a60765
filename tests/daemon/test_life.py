"""All that clients are told of the life of sessions, answer by answer and change by change."""

import json

from bench.process_fixture import FENCE
from rig.daemon.service import METHODS
from rig.daemon.worker import Worker
from rig.reasons import rig_error
from rig.recorder.published import PublishedState
from tests.daemon.rig_in_a_box import CHANGES, Box, Trouble
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
            answer = self.asked(METHODS[deed].bind(values | files))
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
