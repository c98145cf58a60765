"""A virtual board behind a pseudo-terminal, in real time: ``python -m sim.pty``.

Prints the path of the terminal's link on stdout; any program opens it like a board's port, as
often as it likes. Lines on stdin do what hands do at a rig: ``reset``, ``brownout`` (of the
board's supply), ``pull SECONDS [LINK]`` (the cable, and put it in again, perhaps elsewhere),
``mute 1`` (the wire towards the host), ``mute 0``, ``mute fall`` (while chains fall), ``block
MASK`` (beams), ``stop 1``, ``stop 0``; the end of stdin ends it. The log gets a line of JSON for
every drop as the board holds it, and for every change of phase or outputs: true by `at_s`, and not
yet at `after_s`; `gap_s` is the longest time between two looks since the last line, by which the
board may have heard too late.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from contextlib import closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from rig.errors import RigError
from rig.link.messages import Phase, pack_label

from .board import VirtualBoard
from .interfaces import Board
from .line import BadLine
from .scene import set_scene
from .terminal import Terminal

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from .scene import Scene

DEAF_S = 0.065
"""So long an Arduino's reset pin is held low when its port is opened."""
_TICK_S = 4e-3
_CHUNK = 4096


class GlassBoard(Board, Protocol):
    """A board with hands around it, and one that can be looked into."""

    def touch(self, gates: int) -> None:
        """Block the beams of these gates, a bit each, and let all others through."""

    def stop(self, opened: bool) -> None:
        """Open or close the emergency stop."""

    def brown_out(self, at_ns: int) -> None:
        """Restart by a dip of the supply at this time."""

    def outputs(self) -> int:
        """Return the outputs that are on, a bit each."""

    def phase(self) -> int:
        """Tell what it is doing, see `Phase`."""

    def held(self) -> tuple[dict[str, int], list[tuple[int, int]]]:
        """Tell what it keeps of the drop it holds: the certificate's main fields, the events."""


class Bench:
    """The board, its cable and its log.

    Parameters
    ----------
    board
        Its time begins now.
    link
        Symbolic link to the terminal; none by default, it has a path of the kernel's.
    log
        File for what happens, if any.
    line
        What happens to bytes on their way.
    resets
        Whether opening the terminal pulls the reset pin, as the USB chips of Arduinos do.
    """

    def __init__(
        self,
        board: GlassBoard,
        link: Path | None,
        log: Path | None,
        line: BadLine,
        *,
        resets: bool = False,
    ) -> None:
        self.board = board
        self.terminal = Terminal(link, held=not resets)
        self._log = None if log is None else log.open("a", encoding="utf-8", buffering=1)
        self._line = line
        self._resets = resets
        self._deaf_until_ns = 0
        self._plug_at = 0.0
        self._mute = "0"
        self._begun_ns = time.monotonic_ns()
        self._seen: tuple[int, int] = (0, 0)
        self._looked_s = time.monotonic()  # when the last look began
        self._gap_s = 0.0  # between two looks, the longest since the last line of the log

    def serve(self) -> None:
        """Pass bytes and obey until stdin ends."""
        self.board.reset(0)
        words = b""
        while True:
            if self.terminal.wait(_TICK_S, sys.stdin.fileno()):
                if not (typed := os.read(sys.stdin.fileno(), _CHUNK)):
                    return
                *lines, words = (words + typed).split(b"\n")
                for line in lines:
                    self._obey(line.decode().split())
            if not self.terminal.is_in and time.monotonic() >= self._plug_at:
                self.terminal.plug()
            begun_s = time.monotonic()
            self._pass_bytes()
            self._note(begun_s)

    def close(self) -> None:
        """Hang up."""
        self.terminal.pull()
        if self._log is not None:
            self._log.close()

    def _obey(self, words: list[str]) -> None:
        match words:
            case ["reset"]:
                self.board.reset(self._now_ns())
            case ["brownout"]:
                self.board.brown_out(self._now_ns())
            case ["pull", seconds, *elsewhere]:
                self.terminal.pull()
                self._plug_at = time.monotonic() + float(seconds)
                if elsewhere:
                    self.terminal.link = Path(*elsewhere)
            case ["mute", when]:
                self._mute = when
            case ["block", mask]:
                self.board.touch(int(mask, 0))
            case ["stop", opened]:
                self.board.stop(opened == "1")

    def _now_ns(self) -> int:
        now_ns = time.monotonic_ns() - self._begun_ns
        self.board.advance(now_ns)
        return now_ns

    def _pass_bytes(self) -> None:
        now_ns = self._now_ns()
        if self.terminal.look() and self._resets:
            self.board.reset(now_ns)
            self._deaf_until_ns = now_ns + round(DEAF_S * 1e9)
        sent, heard = self._line.transfer(self.board.line.read(now_ns), self.terminal.read())
        if self._mute == "1" or (self._mute == "fall" and self.board.phase() == Phase.RECORDING):
            sent = b""
        if now_ns >= self._deaf_until_ns:
            self.board.receive(now_ns, heard)
        self.terminal.write(sent)

    def _note(self, begun_s: float) -> None:
        # The board's time stood between the two: a busy machine may let long pass in between.
        before_s, now_s, self._looked_s = self._looked_s, time.monotonic(), begun_s
        self._gap_s = max(self._gap_s, now_s - before_s)
        seen = (int(self.board.phase()), self.board.outputs())
        if self._log is None or seen == self._seen:
            return
        # A recording may begin and be aborted between two looks; a reset shows the drop again.
        if seen[0] == Phase.HOLDING != self._seen[0]:
            drop, events = self.board.held()
            self._log.write(json.dumps({"drop": drop, "events": events}) + "\n")
        self._seen = seen
        when = {"at_s": now_s, "after_s": before_s, "gap_s": self._gap_s}
        self._log.write(json.dumps(when | {"phase": seen[0], "outputs": seen[1]}) + "\n")
        self._gap_s = 0.0


def main(
    arguments: Sequence[str] | None = None,
    make: Callable[[Scene], GlassBoard] | None = None,
    scheme: str = "sim",
) -> int:
    """Run until stdin ends.

    Parameters
    ----------
    arguments
        Of the command line.
    make, scheme
        Which board, by default a virtual one, and what its URLs begin with.

    Returns
    -------
    int
        Exit code.
    """
    parser = argparse.ArgumentParser(prog=f"python -m {__package__}.pty", description=__doc__)
    parser.add_argument("--protocol", required=True, help="the scene whose chains fall")
    parser.add_argument("--seed", default="0")
    parser.add_argument("--link", type=Path, help="also make this symbolic link to the terminal")
    parser.add_argument("--log", type=Path, help="file for what happens")
    parser.add_argument(
        "--resets", action="store_true", help="restart the board whenever its terminal is opened"
    )
    parser.add_argument(
        "--busy", type=float, default=0.0, metavar="SHARE", help="of bytes, changed while both "
        "directions are busy: some USB chips do so from 230,400 baud",
    )  # fmt: skip
    parser.add_argument(
        "dial", nargs="*", type=_dial, metavar="NAME=VALUE", help="as in a sim:// URL"
    )
    options = parser.parse_args(arguments)
    settings = {"protocol": options.protocol, "seed": options.seed, **dict(options.dial)}
    try:
        scene = set_scene(scheme, settings)
        # A board that answers in real time makes no drop while it is asked for.
        scene.lab.make_ahead([pack_label(number, 1) for number in sorted(scene.lab.runs)])
        ppm = scene.dials.clock * 1e6
        board = make(scene) if make else VirtualBoard(scene.lab, scene.seed, ppm=ppm)
    except RigError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    line = BadLine(scene.dials.corrupt, scene.dials.lose, options.busy, seed=scene.seed)
    bench = Bench(board, options.link, options.log, line, resets=options.resets)
    with closing(bench), suppress(KeyboardInterrupt):
        print(bench.terminal.path, flush=True)
        bench.serve()
    return 0


def _dial(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals:
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE")
    return name, value


if __name__ == "__main__":
    sys.exit(main())
