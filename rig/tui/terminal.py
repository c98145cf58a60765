"""Terminal driver that keeps a single reader of keys across stops of the program."""

import asyncio

from textual.drivers.linux_driver import LinuxDriver


class Terminal(LinuxDriver):
    """A terminal that is set up again after the program was stopped from outside.

    With Ctrl-Z Textual leaves the terminal first, but not with a SIGSTOP. After the SIGCONT
    Textual 8 would then start a second reader of keys, and each might get a part of an Escape
    sequence. Keys typed while the program was stopped are dropped.
    """

    _left = True

    def start_application_mode(self) -> None:
        """Set the terminal up."""
        self._left = False  # at once: a SIGCONT may come meanwhile
        super().start_application_mode()  # type: ignore[no-untyped-call]

    def suspend_application_mode(self) -> None:
        """Restore the terminal temporarily."""
        super().suspend_application_mode()
        self._left = True

    def resume_application_mode(self) -> None:
        """Set the terminal up again."""
        if self._left:
            super().resume_application_mode()
        else:  # signals may arrive during the handling of another: handle them in order
            asyncio.get_running_loop().call_soon_threadsafe(self._anew)

    def _anew(self) -> None:
        super().suspend_application_mode()
        super().resume_application_mode()
        self._app.refresh(layout=True)
