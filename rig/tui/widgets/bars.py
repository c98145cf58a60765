"""Lines above and below every page: title, tabs, problems, possible keys, and STOP."""

from collections.abc import Mapping
from time import monotonic

from textual.content import Content

from rig.tui.actions import BY_NAME, PAGES, shown_key
from rig.tui.model import UNDER_WAY, Model, alarm
from rig.tui.next_step import next_step
from rig.tui.widgets.text import link_action, plain

LINKS = {"up": "● link up", "opening": "◌ opening", "down": "✗ link down", "closed": "○ no link"}
TABS = {page: BY_NAME[f"page_{page}"].label for page, *_ in PAGES}
"""Texts of the tabs, by page."""
KEYS_SHOWN = 4
_OF_PAGE = {page: keys.split() for page, *_, keys in PAGES}
_ANYWHERE = ("go_on", "control", "part", "help")
_TOLD_S = 4.0
_UNANSWERED_S = 0.5


def problem(model: Model) -> Content:
    """Return the most serious present problem with its remedy; empty without problems."""
    message, _, hint = alarm(model).partition("\n")
    remedy = f"\n  → {plain(hint, 240)}" if hint else ""
    parts = ("✗ ", "bold $error"), (plain(message, 160), "bold"), remedy
    return Content.assemble(*parts) if message else Content("")


def tabs(page: str, keys: Mapping[str, str]) -> Content:
    """Return all pages with their keys; each can be clicked."""
    parts: list[Content] = []
    for name, title in TABS.items():
        text = f" {shown_key(keys[f'page_{name}'])} {title} "
        look = "bold $background on $primary" if name == page else "$foreground 80%"
        parts += [link_action(Content.styled(text, look), f"app.do('page_{name}')"), Content(" ")]
    return Content.assemble(*parts)


def headline(model: Model, width: int) -> Content:
    """Return a line of exactly `width`: page and title left, SIMULATED mark and link right."""
    link = LINKS.get(model.state.link, "○ no link") if model.client.up else "✗ no daemon"
    if model.client.idle:
        link = "file only" if model.offline else "no rig yet"
    right_side = f"{plain(model.client.port, 24)}  {link}" if model.client.port else link
    stamp = " ▲ SIMULATED " * model.simulated
    blind = " BLIND " * model.blind
    name = TABS.get(model.page, model.page).upper()
    title = model.state.section("session").get("title") or "chainrig"
    room = width - len(name) - len(stamp) - len(blind) - len(right_side) - 3
    return Content.assemble(
        (f"{name}  ", "bold $primary"),
        plain(title, max(1, room)).ljust(room),
        (stamp, "bold $background on $warning"),
        (blind, "bold $background on $accent"),
        f" {right_side}",
    )


def stop_line(model: Model, keys: Mapping[str, str]) -> Content:
    """Return the STOP bar, also for the mouse, with the present activity."""
    stop = Content(f" ■ STOP  {shown_key(keys['stop'])} or Esc ")
    return Content.assemble(link_action(stop, "app.do('stop')"), f"  {_doing(model)}")


def hints(model: Model, keys: Mapping[str, str], width: int) -> Content:
    """Return the most important keys now; all others are in the palette."""
    labels = {name: action.label for name, action in BY_NAME.items()}
    labels["go_on"] = next_step(model).enter
    labels["control"] = "" if model.client.driving else "take control"
    labels["unblind"] *= model.blind
    if model.flow.verdict == "rejected":
        labels["reject"] = "undo rejection"
    names = dict.fromkeys((*_OF_PAGE.get(model.page, ()), *_ANYWHERE))
    useful = [name for name in names if labels[name] and model.allows(BY_NAME[name])]
    line = Content("")
    for name in (*useful[: KEYS_SHOWN - 1], "palette"):
        hint = Content.assemble((shown_key(keys[name]), "bold $primary"), f" {labels[name]}")
        if len(line) + len(hint) + 2 > width:
            break
        line = Content.assemble(line, link_action(hint, f"app.do('{name}')"), "  ")
    return line


def _answer(model: Model) -> str:
    """Return the result of a recent STOP in words."""
    if model.stop is None:
        return ""
    waited = monotonic() - model.stop.at_s
    unheard = model.stop.heard is False or (model.stop.heard is None and waited > _UNANSWERED_S)
    if waited > _TOLD_S and (model.client.up or not unheard):
        return ""
    if unheard:
        return "STOP NOT CONFIRMED: switch the release's supply off"
    return "STOP: everything is off" if model.stop.heard else "STOP …"


def _doing(model: Model) -> str:
    if model.client.idle:
        return "no rig is connected: nothing can fall"
    if not model.client.up:
        return _answer(model) or "no daemon: nothing can be stopped from here"
    answer = _answer(model)
    if answer and not model.hot:
        return answer
    holder = model.state.holder
    watching = "" if model.client.driving or holder is None else f" · watching {holder[:24]}"
    doing = next_step(model).text if model.stage in UNDER_WAY else model.state.phase
    return doing + watching + " · " * bool(answer) + answer
