"""``rig ready``."""

from rig.commands.output import Arguments, say
from rig.files import check_new, write_atomic
from rig.protocol import reader
from rig.ready import ready_protocol, ready_protocols
from rig.text_table import text_table


def main(arguments: Arguments) -> None:
    """List the ready protocols, or copy one into this folder."""
    if arguments.name is None:
        rows = [[name, reader.read(path).title] for name, path in ready_protocols().items()]
        print("\n".join(text_table(rows, left={0, 1})))
        say("try one: rig run NAME --port sim:// --session my.session; copy one: rig ready NAME")
        return
    text = ready_protocol(arguments.name).read_text("utf-8")
    copy = check_new(f"{arguments.name}.yaml")
    write_atomic(copy, text)
    say(f"protocol: {copy}")
