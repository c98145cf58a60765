# SPDX-License-Identifier: GPL-3.0-or-later
"""The emulated board behind a pseudo-terminal, in real time: ``python -m rig_emulator.pty``.

Prints the terminal's path on stdout; any program opens that like a board's port, as often as it
likes. SIGUSR1 presses the reset button (a pseudo-terminal does not pass DTR on), SIGTERM and
Ctrl-C end it.
"""

from __future__ import annotations

import argparse
import signal
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import RigError
from rig_emulator.board import EmulatedBoard
from rig_emulator.protocol_emu import board_before
from rig_emulator.wiring import BOARDS, board_named, firmware_for
from sim.scene import set_scene
from sim.terminal import Terminal

if TYPE_CHECKING:
    from collections.abc import Sequence

BAUDRATE = 500_000
_TICK_S = 1e-3
_LOST_S = 0.1  # a computer too slow for real time lets the board's time lag behind


class Bridge:
    """A pseudo-terminal with a board at its far end.

    Parameters
    ----------
    board
        The board; its time begins now.

    Attributes
    ----------
    path
        Where other programs find it.
    """

    def __init__(self, board: EmulatedBoard) -> None:
        self.board = board
        self._terminal = Terminal()
        self.path = self._terminal.path
        self._start_ns = time.monotonic_ns()
        self._now_ns = 0
        self._asked_to_reset = self._asked_to_stop = False

    def reset(self) -> None:
        """Press the reset button at the next opportunity (safe in a signal handler)."""
        self._asked_to_reset = True

    def stop(self) -> None:
        """End `serve` at the next opportunity (safe in a signal handler)."""
        self._asked_to_stop = True

    def serve(self) -> None:
        """Pass bytes both ways until `stop`."""
        while not self._asked_to_stop:
            self._terminal.wait(_TICK_S)
            self._catch_up()
            if self._asked_to_reset:
                self._asked_to_reset = False
                self.board.reset(self._now_ns)
            self.board.receive(self._now_ns, self._terminal.read())

    def close(self) -> None:
        """Hang up."""
        self._terminal.pull()

    def _catch_up(self) -> None:
        real_ns = time.monotonic_ns() - self._start_ns
        late_ns = real_ns - self._now_ns - round(_LOST_S * 1e9)
        if late_ns > 0:
            self._start_ns += late_ns
            real_ns -= late_ns
        self._now_ns = real_ns
        self.board.advance(real_ns)
        self._terminal.write(self.board.line.arrived(real_ns))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run until told to stop.

    Returns
    -------
    int
        Exit code.
    """
    options = _parser().parse_args(arguments)
    try:
        bridge = Bridge(_board(options))
    except RigError as error:
        print(f"rig_emulator: {error}", file=sys.stderr)
        return error.exit_code
    link: Path | None = options.link
    try:
        if link is not None:
            link.unlink(missing_ok=True)
            link.symlink_to(bridge.path)
        signal.signal(signal.SIGUSR1, lambda *_: bridge.reset())
        signal.signal(signal.SIGTERM, lambda *_: bridge.stop())
        signal.signal(signal.SIGINT, lambda *_: bridge.stop())
        print(bridge.path, flush=True)
        bridge.serve()
    except (RigError, OSError) as error:
        print(f"rig_emulator: {error}", file=sys.stderr)
        return error.exit_code if isinstance(error, RigError) else 1
    finally:
        if link is not None and link.is_symlink():
            link.unlink()
        bridge.close()
    return 0


def _board(options: argparse.Namespace) -> EmulatedBoard:
    wiring = board_named(options.board)
    program = options.elf or firmware_for(wiring)
    if options.protocol is None:
        return EmulatedBoard(wiring, program, seed=options.seed, baudrate=BAUDRATE)
    settings = {"protocol": str(options.protocol), "seed": str(options.seed)}
    settings |= dict(text.split("=", 1) for text in options.dial)
    return board_before(set_scene("emu", settings), wiring, program, BAUDRATE)


def _dial(text: str) -> str:
    if "=" not in text:
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE")
    return text


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m rig_emulator.pty", description=__doc__)
    parser.add_argument("--board", choices=sorted(BOARDS), default="mega")
    parser.add_argument("--protocol", type=Path, help="the scene whose chains fall; else none do")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--elf", type=Path, help="another firmware than the built one")
    parser.add_argument("--link", type=Path, help="also make this symbolic link to the terminal")
    parser.add_argument(
        "dial", nargs="*", type=_dial, metavar="NAME=VALUE", help="as in a URL, with --protocol"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
