"""Results to stdout, narration to stderr."""

from __future__ import annotations

import json
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

VOID = 3


def say(line: str) -> None:
    """Tell the user something that is no result."""
    with suppress(OSError):  # a campaign does not end because nobody listens any more
        print(line, file=sys.stderr, flush=True)


def progress(what: str) -> Callable[[int, int], None]:
    """Count up on one line of a terminal; silent elsewhere."""

    def show(done: int, of: int) -> None:
        if sys.stderr.isatty():
            end = "\n" if done == of else ""
            print(f"\r{what} {done}/{of}", end=end, file=sys.stderr, flush=True)

    return show


def print_json(data: Mapping[str, Any]) -> None:
    """Print one JSON object."""
    print(json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False))


def print_results(found: Mapping[str, Any], *, as_json: bool) -> int:
    """Print an analysis; the exit code says whether a run is void."""
    if as_json:
        print_json(found)
    else:
        if found["simulated"]:
            print("SIMULATED DATA")
        from rig.report.clock import clock_lines  # noqa: PLC0415 - few commands print one
        from rig.report.table import summary_table  # noqa: PLC0415

        print(summary_table(found))
        print("\n".join(clock_lines(found)))
    return VOID if any(run["verdict"] == "void" for run in found["runs"]) else 0
