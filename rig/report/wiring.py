"""Wiring diagram of a board, with only the parts that a scene needs."""

import re
from xml.etree import ElementTree

from rig.flash.boards import TARGETS
from rig.protocol.protocol import Protocol

_SVG = "http://www.w3.org/2000/svg"
_OPTIONAL = re.compile(r"gate-\d+|release-\d+|reference|sync|sense")


def wiring_drawing(protocol: Protocol, board: str) -> str:
    """Return the wiring of a protocol's gates and release at a board's pins, as SVG.

    Parameters
    ----------
    protocol
        The scene.
    board
        A key of `rig.flash.boards.TARGETS`.
    """
    words = {
        f"gate-{gate.channel}": f"gate {gate.channel}: {gate.height * 1e3:.1f} mm"
        for gate in protocol.gates.gates
    }
    used = {*words, f"release-{protocol.release.channel}"}
    for prefix, uri in (("", _SVG), ("xlink", "http://www.w3.org/1999/xlink")):
        ElementTree.register_namespace(prefix, uri)
    root = ElementTree.parse(TARGETS[board].wiring_path).getroot()  # noqa: S314 - our own
    for node in list(root):
        part = node.get("class", "")
        if _OPTIONAL.fullmatch(part) and part not in used:
            root.remove(node)
        for text in node.iter():
            if part in words and (text.text or "").startswith("gate "):
                text.text = words[part]
    return ElementTree.tostring(root, "unicode")
