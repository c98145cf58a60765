"""``rig estimate``."""

from dataclasses import replace

from rig.commands.output import Arguments, print_data, progress, say, tell_damage
from rig.files import make_folder
from rig.report.canvas import write_figure
from rig.report.estimate import estimate_lines
from rig.report.estimate_figures import estimate_pictures
from rig.results.estimated import session_estimate
from rig.results.whole import check_open, results
from rig.sections import Sections
from rig.session.store import Session


def main(arguments: Arguments) -> int:
    """Estimate the parameters of the impacts from a session."""
    with Session.open(arguments.session, readonly=True) as session:
        folder = None if arguments.output is None else make_folder(arguments.output)
        check_open(session)
        outcome = results(session, progress, fresh=arguments.fresh)
        estimate = session_estimate(session, outcome, progress, fresh=arguments.fresh)
    analysis, simulated = outcome.analysis, outcome.simulated
    likeness = None if analysis.rig is None else analysis.rig.likeness
    sections, data = Sections(), {"simulated": simulated, **estimate.json()}
    lines = [*estimate_lines(estimate, sections)]
    if likeness is not None:
        data["likeness"] = likeness.json()
        lines[:0] = [likeness.sentence] * (not likeness.like)
    print_data(data, lines, as_json=arguments.json)
    if folder is not None:
        for name, figure in estimate_pictures(estimate, sections).items():
            write_figure(folder / f"{name}.svg", replace(figure, simulated=simulated))
            say(f"{folder / name}.svg")
    for sentence in sections.failed.values():
        say(sentence)
    return tell_damage(analysis)
