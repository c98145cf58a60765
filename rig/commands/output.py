"""What every command uses: its arguments; results to stdout, narration to stderr."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from contextlib import contextmanager
from shutil import get_terminal_size
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from rig import streams

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from rig.analysis.session import Analysis
    from rig.results.whole import SessionResults
    from rig.selftest.findings import Finding

VOID = 3
say = streams.say


class Arguments(Namespace):
    """What a command line says: each argument by its name in ``command_help.txt``."""

    session: str
    further: Sequence[str]
    fresh: bool
    json: bool


@contextmanager
def goes_on(hint: str) -> Iterator[None]:
    """Add to the message of Ctrl-C how to continue; see `rig.cli.main`."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(hint) from None


_GAP = "   "  # as between cells of a table, whose lines are not broken


def show(lines: Iterable[str]) -> None:
    """Print results; on a terminal with sentences broken at its width."""
    width = get_terminal_size().columns if sys.stdout.isatty() else sys.maxsize
    for line in lines:
        print("\n".join(_break_sentence(line, width)))


def _break_sentence(line: str, width: int) -> list[str]:
    """Break a sentence at words, what goes on indented; tables stay as they are."""
    words = line.lstrip()
    if len(line) <= width or _GAP in words:
        return [line]
    indent = " " * (len(line) - len(words))
    return wrap(line, width, subsequent_indent=f"{indent}  ", break_on_hyphens=False)


def progress(done: int, of: int, label: str = "analysing run") -> None:
    """Count up on one line of a terminal; silent elsewhere."""
    stage("" if done == of else f"{label} {done}/{of}")


def stage(label: str) -> None:
    """Say what is being worked on, on one line of a terminal that the next one takes; else nothing.

    Parameters
    ----------
    label
        Empty to clear the line.
    """
    if sys.stderr.isatty():
        with streams.tolerate_broken(sys.stderr):
            print(f"\r\x1b[K{label}", end="", file=sys.stderr, flush=True)


def print_data(data: Mapping[str, Any], lines: Iterable[str], *, as_json: bool) -> None:
    """Print a result as JSON, or as lines of text."""
    if as_json:
        print_json(data)
    else:
        show(["SIMULATED DATA"] * bool(data.get("simulated")))
        show(lines)


def print_findings(key: str, findings: Iterable[Finding], *, as_json: bool) -> int:
    """Print each finding as soon as it is made, or all of them as JSON; count those that failed."""
    checks = []
    for finding in findings:
        checks.append(finding)
        if not as_json:
            print(streams.runnable(str(finding)), flush=True)
    if as_json:
        print_json({key: [finding.json() for finding in checks]})
    return sum(finding.failed for finding in checks)


def print_json(data: Mapping[str, Any]) -> None:
    """Print one JSON object."""
    print(json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False))


def print_results(outcome: SessionResults, *, as_json: bool, **members: object) -> int:
    """Print an analysis, as JSON with more members; the exit code says whether a run is void."""
    if as_json:
        print_json(outcome.json() | members)
    else:
        from rig.report import finding, parts, templates  # noqa: PLC0415 - few commands print one

        means = [] if outcome.blind else parts.summary_table(outcome.analysis.summary).splitlines()
        show([*templates.lines("stamp", outcome), *means, *finding.void_lines(outcome.analysis)])
        show([*outcome.analysis.damage, *finding.remarks(outcome)])
    return exit_code(outcome.analysis)


def exit_code(analysis: Analysis) -> int:
    """Return the exit code of a command whose result rests on all runs."""
    void = analysis.damage or any(run.verdict == "void" for run in analysis.runs)
    return VOID if void else 0


def tell_damage(analysis: Analysis) -> int:
    """Say which drops are damaged; the exit code tells it too."""
    for line in analysis.damage:
        say(line)
    return VOID if analysis.damage else 0
