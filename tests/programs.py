"""Other programs, run to their end."""

import subprocess

from tests.waiting import PATIENCE_S


def run_program(*words: object, code: int | None = 0, timeout: float | None = PATIENCE_S, **more):
    """Run a program, and see that it ends with a code, unless that is ``None``."""
    streams = {"capture_output": True, "text": True, "timeout": timeout}
    done = subprocess.run([*map(str, words)], check=False, **streams, **more)
    assert code is None or done.returncode == code, done.stdout + done.stderr
    return done
