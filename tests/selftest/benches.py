"""Boards on a bench for ``rig selftest``, with a wire from the sync output to a gate."""

from rig.link import messages as wire
from rig.link.client import Device
from rig.selftest.board import SelftestOptions
from rig.selftest.findings import Verdict
from rig.selftest.run import selftest
from sim.board import VirtualBoard
from sim.serial_port import SimulatedSerial
from tests.link.bench import ScriptedLab
from tests.link.talk import arm

GATE = 3


def wired(gate: int | None = GATE, late_s: float = 0.0, blocked: int = 0) -> ScriptedLab:
    """Make the lab of a board at which only a wire changes anything, and some gates are blocked."""
    return ScriptedLab(blocked, [] if gate is None else [(late_s, gate, True)])


class LoopedBoard(VirtualBoard):
    """Its wire falls back when the recording ends. It knows whether a release was ever on."""

    driven = 0

    def _close(self):
        super()._close()
        self.touch(0)

    def advance(self, until_ns):
        super().advance(until_ns)
        self.driven |= self.outputs()


def outcomes(port, loopback=GATE, drops=5, release=True, gates=None):
    """Test a board; give its findings by the name of the check."""
    findings = list(selftest(port, SelftestOptions(loopback, drops, release, gates)))
    assert len({finding.name for finding in findings}) == len(findings)
    for finding in findings:
        assert (finding.reason is None) is (finding.verdict is Verdict.OK)
        assert finding.reason is None or finding.what == finding.reason.text
    return {finding.name: finding for finding in findings}


def port_of(board, **settings):
    """Plug a board in."""
    return SimulatedSerial("test", board=board, timeout=0.02, **settings)


def fire_drop(port, run, *tap):
    """Have a board begin a drop without its release; give the client and the drop's label."""
    device = Device(port, port.clock, *tap)
    device.connect()
    label = wire.pack_label(run, 2)
    device.fire(arm(device, label, gates=1 << GATE, release=0, pulse_us=0, record_ms=50))
    return device, label


def hold_drop(port, run):
    """Have a board hold a drop; give the client, the drop's label and the drop."""
    device, label = fire_drop(port, run)
    return device, label, device.collect(label)
