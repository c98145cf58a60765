"""``rig compare``."""

from __future__ import annotations

from argparse import Namespace
from contextlib import ExitStack
from pathlib import Path

from rig.commands.output import VOID, print_found, progress, say
from rig.errors import InputError
from rig.files import check_place, write_atomic
from rig.reasons import make_error
from rig.report.canvas import write_figure
from rig.report.comparison import (
    comparison_page,
    difference_lines,
    draw_comparison,
    pooled_lines,
)
from rig.results.together import TogetherResults, results_together
from rig.session.store import Session


def main(arguments: Namespace) -> int:
    """Compare sessions with the first of them."""
    if arguments.output is not None:
        check_place(arguments.output)
    together = read_together(arguments)
    lines = difference_lines(together)
    print_found(together.comparison_json(), lambda: "\n".join(lines), as_json=arguments.json)
    if arguments.output is not None:
        if arguments.output.endswith((".html", ".htm")):
            write_atomic(arguments.output, comparison_page(together))
        else:
            write_figure(Path(arguments.output), draw_comparison(together))
        say(f"comparison: {arguments.output}")
    return 0


def analyze_together(arguments: Namespace) -> int:
    """Print the results of several sessions in one joint fit, as ``rig analyze A B`` does."""
    single = ("budget", "video", "session_trials", "priors", "scatter")
    if options := [name for name in single if getattr(arguments, name) not in {None, False}]:
        names = ", ".join(f"--{name.replace('_', '-')}" for name in options)
        raise make_error(InputError, "option_for_one_session", options=names)
    together = read_together(arguments)
    lines = pooled_lines(together)
    print_found(together.json(), lambda: "\n".join(lines), as_json=arguments.json)
    return VOID if together.void else 0


def read_together(arguments: Namespace) -> TogetherResults:
    """Analyse the sessions of a command line together."""
    with ExitStack() as open_files:
        files = [
            open_files.enter_context(Session.open(path, readonly=True))
            for path in (arguments.session, *arguments.further)
        ]
        return results_together(
            files,
            same_rig=arguments.same_rig,
            unfinished=arguments.unfinished,
            fresh=arguments.fresh,
            progress=progress("analysing run"),
        )
