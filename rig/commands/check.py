"""``rig check``."""

from rig.boards import BOARDS
from rig.commands.output import Arguments, print_data
from rig.predictions import notes
from rig.protocol import reader
from rig.protocol.describe import describe
from rig.protocol.measurable import check_gates, check_recordable
from rig.protocol.protocol import Protocol


def main(arguments: Arguments) -> None:
    """Describe a protocol, or what any protocol may say."""
    if arguments.protocol is None:
        from rig.protocol.reference import page, schema  # noqa: PLC0415 - of no use to a protocol

        print_data(schema(), [page().rstrip()], as_json=arguments.schema)
        return
    protocol = reader.read(arguments.protocol)
    if arguments.board and protocol.gates:
        check_recordable(protocol, BOARDS[arguments.board])
    if arguments.output:
        from rig.report import canvas, mounting  # noqa: PLC0415 - matplotlib, only here

        check_gates(protocol)
        canvas.write_figure(arguments.output, mounting.mounting_figure(protocol))
    print(describe(protocol, [*notes(protocol), *_trials(protocol)]))


def _trials(protocol: Protocol) -> list[str]:
    """Say how many simulated drops the gates of a protocol identify, if it can be measured."""
    if protocol.thrown or not protocol.gates:
        return []
    from rig.design.trials import trials  # noqa: PLC0415 - numpy, only with gates
    from rig.report.templates import sentence  # noqa: PLC0415

    return [sentence("trials", trials(protocol), protocol.vocabulary)]
