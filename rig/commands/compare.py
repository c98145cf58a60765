"""``rig compare``."""

from contextlib import ExitStack

from rig.commands.output import Arguments, exit_code, print_data, progress, say
from rig.files import write_atomic
from rig.report import comparison
from rig.report.canvas import write_figure
from rig.results.together import TogetherResults, results_together
from rig.session.store import Session


def main(arguments: Arguments) -> None:
    """Compare sessions with the first of them."""
    together = read_together(arguments)
    lines = comparison.difference_lines(together)
    print_data(together.comparison_json(), lines, as_json=arguments.json)
    if arguments.output is not None:
        if arguments.output.suffix in {".html", ".htm"}:
            write_atomic(arguments.output, comparison.comparison_page(together))
        else:
            write_figure(arguments.output, comparison.draw_comparison(together))
        say(f"comparison: {arguments.output}")


def analyze_together(arguments: Arguments) -> int:
    """Print the results of several sessions in one joint fit, as ``rig analyze A B`` does."""
    together = read_together(arguments)
    print_data(together.json(), comparison.pooled_lines(together), as_json=arguments.json)
    return max(exit_code(analysis) for _, analysis in together.analyses())


def read_together(arguments: Arguments) -> TogetherResults:
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
            progress=progress,
        )
