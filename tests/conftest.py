"""What holds for every test."""

from __future__ import annotations

import signal

from hypothesis import settings
from hypothesis.internal.conjecture import providers

# `./run test` says the same every time: the same examples, and none that an earlier run has left.
# To look for new ones is for `./run bench search`, which keeps what it finds under .hypothesis/.
# A busy machine is no fault of the code: no example is timed.
settings.register_profile("same", derandomize=True, database=None, deadline=None)
settings.register_profile("search", max_examples=2000, deadline=None)
settings.load_profile("same")


def pytest_configure() -> None:
    # A shell has what runs in its background ignore Ctrl-C, and so would all that tests start.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # Hypothesis also tries numbers that stand in the project's modules, those loaded so far: what
    # they are depends on which tests ran before in this process.
    if settings().derandomize:
        providers._get_local_constants = providers.Constants
