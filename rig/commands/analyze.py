"""``rig analyze``."""

from typing import Any

from rig.analysis.result import Measured
from rig.analysis.video import video_fall
from rig.cache.entry import recall
from rig.commands.output import Arguments, print_results, progress, say, show, tell_damage
from rig.measurands import acceleration_in
from rig.reasons import make_reason
from rig.report.parts import scatter_parts, tables
from rig.report.templates import lines
from rig.results.whole import SessionResults, complete_analysis, protocol_of, results
from rig.session.store import Session
from rig.timers.video import read_video


def main(arguments: Arguments) -> int:
    """Compute the results of a session, or of several together."""
    if arguments.further:
        from rig.commands.compare import analyze_together  # noqa: PLC0415 - only for several

        return analyze_together(arguments)
    track = read_video(arguments.video) if arguments.video else None
    if track and track.unused:
        say(make_reason("track_unused", rows=track.unused).text)
    with Session.open(arguments.session, readonly=True) as session:
        outcome = results(session, progress, fresh=arguments.fresh)
        if arguments.budget is not None:
            from rig.commands.budget import print_budget  # noqa: PLC0415 - only when it is asked for

            print_budget(session, outcome, arguments)
            return tell_damage(outcome.analysis)
        members: dict[str, Any] = {}
        if arguments.priors:
            members["prior_sensitivity"] = _sensitivity(session, outcome, fresh=arguments.fresh)
    video = video_fall(*track[:3], _by_gates(outcome)) if track and not outcome.blind else None
    if video is not None:
        members["video"] = video.json()
    code = print_results(outcome, as_json=arguments.json, **members)
    if not arguments.json:
        summary = outcome.analysis.summary
        asked = [*scatter_parts(summary)] if arguments.scatter else []
        asked += tables("priors", members["prior_sensitivity"]) if arguments.priors else ()
        asked += tables("gates", (gate for line in summary for gate in line.gates))
        asked += tables("effects", outcome.analysis.effects)
        for part in asked:
            show(["", part.heading, *part.table])
        if video is not None:
            show(["", *lines("video", video)])
    return code


def _sensitivity(session: Session, outcome: SessionResults, *, fresh: bool) -> list[dict[str, Any]]:
    """Adjust the session again with each prior wider and narrower."""
    from rig.analysis.sensitivity import prior_sensitivity  # noqa: PLC0415 - only when it is asked for

    def make() -> list[dict[str, Any]]:
        return prior_sensitivity(
            protocol_of(session), complete_analysis(session, outcome, progress)
        )

    return recall(list, make, "priors", outcome.digest, fresh=fresh)


def _by_gates(outcome: SessionResults) -> Measured | None:
    """Acceleration that the gates found: of what only falls, or of the free chain."""
    for line in outcome.analysis.summary:
        if row := acceleration_in(line.means):
            return line.means[row.name]
    return None if outcome.gravity is None else outcome.gravity.measured
