"""avr8js behind the face that `rig_emulator.avr.Avr` shows to a `Stand`."""

import fcntl
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any, Self

import pytest

from rig_emulator.controller import Change, Sent, Stop
from tests.programs import run_program

HERE = Path(__file__).parent
_INSTALLED = HERE / "node_modules" / "avr8js" / "package.json"


def install() -> None:
    """Have npm fetch avr8js, or skip: whoever has no node loses nothing but a second opinion."""
    missing = [tool for tool in ("node", "npm") if shutil.which(tool) is None]
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)}")
    wanted = json.loads((HERE / "package.json").read_text())["dependencies"]["avr8js"]
    with (HERE / "package.json").open() as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # one test process at a time
        if _INSTALLED.is_file() and json.loads(_INSTALLED.read_text())["version"] == wanted:
            return
        words = ["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--fetch-retries=0"]
        done = run_program(*words, code=None, timeout=None, cwd=HERE)
    if done.returncode:
        why = [line for line in done.stderr.splitlines() if line.startswith("npm error")]
        pytest.skip(f"npm could not install avr8js {wanted}: {'; '.join(why[:2])}")


class Avr8js:
    """An ATmega328P at 16 MHz, stopped at cycle 0; a context manager.

    Parameters
    ----------
    program
        Intel HEX.
    byte_cycles
        How long a byte of the host's lasts.
    """

    def __init__(self, program: Path, byte_cycles: int = 320) -> None:
        self.cycle = self.resets = self.overruns = 0
        self._byte_cycles = byte_cycles
        self._line_free = 0
        self._script: dict[str, list[Any]] = {"edges": [], "bytes": [], "eeprom": []}
        self._watched: set[str] = set()
        self._changes: list[Change] = []
        self._sent: list[Sent] = []
        self._node = subprocess.Popen(
            ["node", HERE / "run.mjs", program],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with self._node:
            self._node.stdin.close()  # node ends with its input

    def run(self, until: int) -> Stop:
        script = {**self._script, "until": until, "stop": sorted(self._watched)}
        self._script = {"edges": [], "bytes": [], "eeprom": []}
        self._node.stdin.write(json.dumps(script) + "\n")
        self._node.stdin.flush()
        answer = json.loads(self._node.stdout.readline())
        self._changes += [Change(**change) for change in answer["changes"]]
        self._sent += [Sent(sent["cycle"], sent["byte"]) for sent in answer["sent"]]
        self.cycle, self.resets = answer["cycle"], answer["resets"]
        self.overruns = answer["overruns"]
        return Stop.PIN if answer["stopped"] else Stop.REACHED

    def edge(self, cycle: int, pin: str, level: bool) -> None:
        self._script["edges"].append({"cycle": cycle, "pin": pin, "level": level})

    def eeprom_write(self, address: int, data: bytes) -> None:
        self._script["eeprom"] += [
            {"address": at, "byte": byte} for at, byte in enumerate(data, start=address)
        ]

    def watch(self, pin: str) -> None:
        self._watched.add(pin)

    def take_changes(self) -> list[Change]:
        taken, self._changes = self._changes, []
        return taken

    def receive(self, data: bytes) -> None:
        self._line_free = max(self._line_free, self.cycle)
        for byte in data:
            self._line_free += self._byte_cycles
            self._script["bytes"].append({"cycle": self._line_free, "byte": byte})

    def take_sent(self) -> list[Sent]:
        taken, self._sent = self._sent, []
        return taken
