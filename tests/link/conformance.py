"""One suite for every device that speaks the wire: inherit `DeviceConformance`, give it a bench.

The bench is the device with hands around it, see `tests.link.bench`.
"""

from tests.link.suite_drop import CheckSuite, DropSuite, HoldSuite, InputSuite, RefusalSuite
from tests.link.suite_line import LineSuite
from tests.link.suite_memory import MemorySuite
from tests.link.suite_safe import SafetySuite


class DeviceConformance(
    CheckSuite, DropSuite, HoldSuite, MemorySuite, RefusalSuite, SafetySuite, InputSuite, LineSuite
):
    """What every device must do."""
