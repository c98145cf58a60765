"""Other programs, run to their end."""

import json
import subprocess
from collections.abc import Container
from typing import Any, NamedTuple

from tests.waiting import PATIENCE_S


class Done(NamedTuple):
    """How a command ended."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """What it printed, read again."""
        return json.loads(self.out)


def end(code: int, out: str, err: str, codes: int | Container[int] = 0) -> Done:
    """See that a command ended with a code, or one of several, and never with a traceback."""
    __tracebackhide__ = True
    assert code == codes if isinstance(codes, int) else code in codes, out + err
    assert "Traceback" not in err, err
    return Done(code, out, err)


def run_program(*words: object, code: int | None = 0, timeout: float | None = PATIENCE_S, **more):
    """Run a program, and see that it ends with a code, unless that is ``None``."""
    streams = {"capture_output": True, "text": True, "timeout": timeout}
    done = subprocess.run([*map(str, words)], check=False, **streams, **more)
    assert code is None or done.returncode == code, done.stdout + done.stderr
    return done
