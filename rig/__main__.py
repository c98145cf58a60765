"""``python -m rig``, and the ``rig`` command. To import it makes Ctrl-C end the process."""

_INTERRUPTED = 130
try:
    import os
    import signal
    import sys
except (KeyboardInterrupt, RuntimeError):  # a class in the making turns what strikes it into this
    raise SystemExit(_INTERRUPTED) from None


def _leave(*_: object) -> None:
    """End at once: nothing is open yet, and a module half loaded is no place to come back from."""
    try:
        os.write(2, b"rig: interrupted\n")
    finally:  # also where nobody reads it
        os._exit(_INTERRUPTED)


_OURS = signal.getsignal(signal.SIGINT) is signal.default_int_handler
if _OURS:  # here, since what pip writes to call `start` is at work for a while before it does
    signal.signal(signal.SIGINT, _leave)


def start() -> None:
    """Run one command and end the process, by 130 and in a few words after Ctrl-C."""
    try:
        from rig.cli import main  # noqa: PLC0415 - takes long enough to be interrupted

        code = main()
    except Exception as error:
        from rig.commands.internal_error import report  # noqa: PLC0415 - no command needs it

        code = report(error)
    finally:
        if _OURS:
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # all is done, and said
    sys.exit(code)


if __name__ == "__main__":
    start()
