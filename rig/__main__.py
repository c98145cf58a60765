"""``python -m rig``, and the ``rig`` command."""

from __future__ import annotations

import os
import signal
import sys

_INTERRUPTED = 130


def start() -> None:
    """Run one command and end the process, by 130 and without a word more after Ctrl-C."""
    ours = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if ours:
        signal.signal(signal.SIGINT, lambda *_: os._exit(_INTERRUPTED))  # nothing is open yet
    from rig.cli import main  # noqa: PLC0415 - takes long enough to be interrupted

    if ours:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        code = main()
    finally:
        if ours:
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # all is done, and said
    sys.exit(code)


if __name__ == "__main__":
    start()
