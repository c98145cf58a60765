"""``rig notes``."""

from rig.commands.output import Arguments
from rig.reasons import plain_reason, rig_error
from rig.report.numbers import ranges
from rig.session.store import Session
from rig.wordings import NOTE


def main(arguments: Arguments) -> None:
    """Add a note to a recorded run; its verdict stays."""
    with Session.open(arguments.session) as session:
        last = session.latest_state(arguments.run)
        if last is None or session.drop(last.run, last.attempt) is None:
            runs = ranges("run", [drop.run for drop in session.latest_drops()])
            raise rig_error("run_unrecorded", path=arguments.session, run=arguments.run, runs=runs)
        reasons = (*last.reasons, plain_reason(arguments.text, NOTE))
        # The host's clock may have begun anew since the drop: the entry keeps the drop's time.
        session.add_state(last.run, last.attempt, last.state, last.host_ns, reasons)
    print(f"noted to run {last.run}, attempt {last.attempt}: {arguments.text}")
