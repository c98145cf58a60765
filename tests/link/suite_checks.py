"""What `rig selftest` asks of a board, asked of every device; here with a lab that moves."""

from rig.selftest.board import SelftestOptions
from rig.selftest.findings import Verdict
from rig.selftest.run import selftest
from tests.link.suite import Suite

NEEDS_HANDS = {"GATE_BLOCKED", "sync output to gate", "GATE_UNSTEADY", "STOPPED", "NOT_KEPT"}


class CheckSuite(Suite):
    def test_it_passes_the_self_test(self, bench):
        findings = list(selftest(bench.port(), SelftestOptions(release=True)))
        assert [str(one) for one in findings if one.verdict is Verdict.FAILED] == []
        assert {one.name for one in findings if one.verdict is not Verdict.OK} == NEEDS_HANDS
