"""Rules between keys of a protocol, each once.

Rules for single keys are in `rig.protocol.keys`; those for the rods of a chain in
`rig.protocol.chains`, and those for gates and rods in `rig.protocol.gates`.
"""

from collections.abc import Iterable, Mapping
from math import prod

from rig.protocol.contact import lacking_geometry
from rig.protocol.fields import DEFAULTS, Section
from rig.protocol.protocol import RodChain
from rig.protocol.yamltree import Sequence

MOST_RUNS = 100_000


def check_scene(top: Section, chains: Mapping[str, RodChain | None], *, kept: bool) -> None:
    """Note all keys of a file that do not suit its scene.

    Parameters
    ----------
    top
        The root of the file.
    chains
        Chains by name, as read; `None` for a faulty chain.
    kept
        Whether the file is stored in a session, see `rig.protocol.reader.parse`.
    """
    struck = "surface" in top
    count = len(chains)
    rods = () if None in chains.values() else tuple(filter(None, chains.values()))
    if struck or {"gravity", "site"} <= top.keys.keys():  # without a surface gravity is measured
        top.need("gravity", "site")
    if struck or "gates" in top:
        top.need("drop")
    if not struck and count > 1:
        top.fault("chains", f"found {count} chains; without a surface one is accepted")
    # A faulty chain is left out: it may or may not give its α.
    if top["surface"] and any(chain.chain.alpha is None for chain in rods):
        top["surface"].need("restitution")
    if "track" in top and (struck or any(chain.chain.rods > 1 for chain in rods)):
        top.fault("track", "a track is for one object without a surface; leave track out")
    if top["drag"]:
        _check_drag(top["drag"], rods)
    if "contact" in top and not struck:
        top.fault("contact", "the scene has no surface; leave contact out")
    if top["plan"]:
        _check_plan(top["plan"], struck=struck, turns=kept or count != 1)
    on_board = struck and _is_on_board(top["contact"], rods)
    if top["gates"]:
        from rig.protocol.gates import check_clear, check_sides  # noqa: PLC0415 - a scene may have none

        check_sides(top["gates"], surface=struck, chains=count)
        if rods and "drop" in top and top.is_sound("drop"):
            inclines = top["plan"]["incline"] if top["plan"] else DEFAULTS["plan.incline"]
            inclines = [angle for angle in inclines or () if on_board and angle is not None]
            check_clear(top, rods, inclines)


def _check_drag(drag: Section, chains: Iterable[RodChain]) -> None:
    """Note drag stated twice or not at all, and missing rod data for a drag coefficient."""
    stated = drag.need("coefficient", "terminal_speed")
    if stated == "terminal_speed":
        drag.refuse("not used with terminal_speed; leave {} out", "air_density")
    if stated == "coefficient":
        for rods in chains:
            if missing := ", ".join(rods.missing_keys):
                message = f"needs {missing} of {rods.name}; state it, or terminal_speed instead"
                drag.fault("coefficient", message)


def _check_plan(plan: Section, *, struck: bool, turns: bool) -> None:
    """Note inclines and turns that a scene does not have, repeated inclines, and too many runs."""
    if not struck:
        plan.refuse("the scene has no surface; leave {} out", "incline")
    if "order" in plan and plan["order"] in {"ABBA", "alternate"} and not turns:
        plan.fault("order", f"found {plan['order']}, which needs two chains; leave order out")
    inclines, node = plan["incline"] or (), plan.nodes.get("incline")
    lines: dict[float, int] = {}
    for n, item in enumerate(node.items if isinstance(node, Sequence) else ()):
        if inclines[n] in lines:
            message = f"found {item} again (line {lines[inclines[n]]}); use repeats for more drops"
            plan.faults.add(item.place, f"{plan.key('incline')}[{n}]", message)
        elif inclines[n] is not None:
            lines[inclines[n]] = item.place.line
    varied = getattr(plan["vary"], "entries", ())
    cases = len(inclines) * prod(len(getattr(values, "items", "-")) for _, values in varied)
    runs = cases * plan["repeats"] if plan.is_sound("incline", "repeats") else 0
    if runs > MOST_RUNS:
        plan.fault("repeats", f"found {runs} runs; at most {MOST_RUNS} are accepted")


def _is_on_board(contact: Section | None, chains: Iterable[RodChain]) -> bool:
    """Whether heights are measured from a board; notes keys that chains then lack."""
    if contact is None or contact["datum"] != "board":
        return False
    lacking = [f"chains.{rods.name}.{key}" for rods in chains for key in lacking_geometry(rods)[:1]]
    for key in lacking:
        contact.fault("datum", f"datum: board needs {key}; state it")
    return not lacking
