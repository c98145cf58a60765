"""The real terminal: its keys have one reader, whatever the program goes through."""

from __future__ import annotations

import asyncio

from textual.drivers.linux_driver import LinuxDriver


class Terminal(LinuxDriver):
    """A terminal that is set up anew where the program was stopped from outside and goes on.

    Ctrl-Z has Textual leave the terminal first; a SIGSTOP does not, and with the SIGCONT after it
    Textual 8 would start a second reader of keys beside the first: of an Escape each might get a
    part. What was typed while the program stood still is dropped.
    """

    _left = True

    def start_application_mode(self) -> None:
        """Take the terminal over."""
        super().start_application_mode()  # type: ignore[no-untyped-call]
        self._left = False

    def suspend_application_mode(self) -> None:
        """Leave it as it was, for some time."""
        super().suspend_application_mode()
        self._left = True

    def resume_application_mode(self) -> None:
        """Take it over once more."""
        if self._left:
            super().resume_application_mode()
        else:  # one signal may come while another one is obeyed: one after the other
            asyncio.get_running_loop().call_soon_threadsafe(self._anew)

    def _anew(self) -> None:
        super().suspend_application_mode()
        super().resume_application_mode()
        self._app.refresh(layout=True)
