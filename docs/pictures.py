"""Draws the pictures of the pages: ``./run pictures``, or ``python docs/pictures.py FOLDER``.

Every picture comes from the program: the falling chains from its model, drawings, card and report
from the commands that a page prints. The same version draws the same pictures.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from string import Template

import numpy as np
from PIL import Image

from rig.analysis.trajectory import free_trajectory, struck_trajectory
from rig.model.fall import kicks
from rig.predictions import predict_incline
from rig.protocol.reader import read

ROOT = Path(__file__).resolve().parents[1]
INCLINE_DEG = 40.0
PERIOD_S = 8.0
HANGING_S = 0.8  # of the period, before the release
SLOWER = 10  # times slower than the fall, which lasts half a second
MOMENTS = 48  # of the fall; between them chains move steadily
PX_PER_M = 240.0
CONTACT_PX = 352.0  # of the picture's height, where rods strike
PLOT = (470.0, 320.0, 350.0, 240.0)
"""Left, bottom, width and height of the plot's axes."""
TICKS_MS = (0, 100, 200, 300, 400, 500)
TICKS_CM = (0, 5, 10)
REPORT_PX = (1000, 960)
COLOURS = 48  # of a screenshot: text and one figure


def loop() -> str:
    """Draw a loop of eight seconds: two chains that fall, and how far one is ahead of the other.

    Whoever asks for less motion gets its last moment, without motion.
    """
    protocol = read(ROOT / "protocols/inclined-uniform.yaml")
    chain, drop, gravity = protocol.chains["A"].chain, protocol.drop.value, protocol.gravity.value
    model = predict_incline(protocol, INCLINE_DEG, "A")
    assert model.alpha is not None
    assert model.gamma is not None
    gains = np.array(kicks(chain, [model.alpha] * chain.rods, model.gamma))
    places = np.array(chain.heights)
    struck = struck_trajectory(0.0, drop, gravity, np.ones(chain.rods), gains, places)
    lasting = float(struck.time[-1])
    begin, end = HANGING_S / PERIOD_S, (HANGING_S + SLOWER * lasting) / PERIOD_S
    left, bottom, width, height = PLOT
    part = np.arange(MOMENTS + 1) / MOMENTS
    heights, speeds = struck.heights(lasting * part)
    free, _ = free_trajectory(0.0, drop, gravity).heights(lasting * part)
    most = float((free - heights)[-1])
    shares = (begin + (end - begin) * part).tolist()
    falls = {
        "strike": (PX_PER_M * (drop - heights)).tolist(),
        "free": (PX_PER_M * (drop - free)).tolist(),
    }
    across, up = left + width * part, bottom - height * (free - heights) / most
    curve = [*zip(across.tolist(), up.tolist(), strict=True)]
    moves = {name: [(0.0, down) for down in downs] for name, downs in falls.items()}
    rods = [CONTACT_PX - PX_PER_M * (drop + above) for above in chain.heights]
    hits = (HANGING_S + SLOWER * struck.time[1:]).tolist()
    return Template((ROOT / "docs/loop.svg.txt").read_text("utf-8")).substitute(
        period=f"{PERIOD_S:g}",
        keyframes="\n".join(_keyframes(*move, shares) for move in (moves | {"dot": curve}).items()),
        begin=f"{100 * begin:.2f}",
        end=f"{100 * end:.2f}",
        strike=f"{falls['strike'][-1]:.1f}",
        free=f"{falls['free'][-1]:.1f}",
        striking=_chain(110.0, rods),
        falling=_chain(290.0, rods),
        lying="".join(
            f'<path class="lying" style="animation-delay:{hit:.2f}s" d="M96 {CONTACT_PX}h28"/>'
            for hit in hits
        ),
        contact=f"{CONTACT_PX:g}",
        ahead=f"{CONTACT_PX - PX_PER_M * most:.1f}",
        between=f"{CONTACT_PX - PX_PER_M * most / 2.0:.1f}",
        cm=f"{100 * most:.1f}",
        ms=f"{1e3 * lasting:.0f}",
        speed=f"{speeds[-1]:.1f}",
        curve=" ".join(f"{x:.1f},{y:.1f}" for x, y in curve),
        dot=f"translate({curve[-1][0]:.1f}px,{curve[-1][1]:.1f}px)",
        ticks=_ticks(1e3 * lasting, 100 * most),
        slower=SLOWER,
        incline=f"{INCLINE_DEG:g}",
    )


def _keyframes(name: str, places: list[tuple[float, float]], shares: list[float]) -> str:
    """Write where a group is at each share of the period; it rests before and after."""
    lines = [
        f"{100 * share:.2f}%{{transform:translate({x:.1f}px,{y:.1f}px)}}"
        for share, (x, y) in zip([0.0, *shares, 1.0], [places[0], *places, places[-1]], strict=True)
    ]
    return f"@keyframes {name}{{{''.join(lines)}}}"


def _chain(x: float, heights: list[float]) -> str:
    """Draw rods, each tilted against its neighbours, and the two strings through their ends."""
    tilts = [3 if number % 2 else -3 for number in range(len(heights))]
    rods = "".join(
        f"M{x - 14:g} {y + tilt:.1f}L{x + 14:g} {y - tilt:.1f}"
        for y, tilt in zip(heights, tilts, strict=True)
    )
    strings = "".join(f"M{x + away:g} {heights[0]:.1f}V{heights[-1]:.1f}" for away in (-14, 14))
    return f'<path class="strings" d="{strings}"/><path d="{rods}"/>'


def _ticks(end_ms: float, most_cm: float) -> str:
    """Draw the numbers of both axes, and a rule at each of the upright one."""
    left, bottom, width, height = PLOT
    upright = [(cm, bottom - height * cm / most_cm) for cm in TICKS_CM]
    level = [(ms, left + width * ms / end_ms) for ms in TICKS_MS]
    return "".join(
        f'<path class="rule" d="M{left:g} {y:.1f}h{width:g}"/><text class="small" '
        f'x="{left - 8:g}" y="{y + 5:.1f}" text-anchor="end">{cm}</text>'
        for cm, y in upright
    ) + "".join(
        f'<text class="small" x="{x:.1f}" y="{bottom + 24:g}" text-anchor="middle">{ms}</text>'
        for ms, x in level
    )


def card(results: dict[str, list[dict[str, dict[str, float]]]]) -> str:
    """Draw what a session measured, as `rig analyze --json` writes it, beside the true value."""
    measured, true = results["summary"][0]["gravity_m_s2"], 9.81
    value, expanded = measured["value"], measured["U95"]
    scale = 100.0 / expanded
    return Template((ROOT / "docs/card.svg.txt").read_text("utf-8")).substitute(
        value=f"{value:.3f}",
        expanded=f"{expanded:.3f}",
        runs=results["summary"][0]["n"],
        true=f"{true:g}",
        at=f"{180.0 + scale * (true - value):.1f}",
    )


def screenshot(page: Path, picture: Path) -> None:
    """Take a picture of a page in a browser, in few colours."""
    browser = shutil.which("chromium")
    if browser is None:
        raise SystemExit("no browser: apt-get install chromium")
    quiet = ("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars")
    size = f"--window-size={','.join(map(str, REPORT_PX))}"
    command = [browser, *quiet, size, f"--screenshot={picture}", page.as_uri()]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    with Image.open(picture) as whole:
        whole.convert("RGB").quantize(COLOURS).save(picture, optimize=True)


def first_block(page: str, language: str, words: str) -> str:
    """Return the first block of a page that has some words: what a reader types there."""
    text = (ROOT / page).read_text("utf-8")
    blocks = re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    return next(block for block in blocks if words in block)


def carry_out(command: str, folder: Path) -> str:
    """Carry out commands of a page in a folder, and return what they print."""
    bin_folder = Path(sys.executable).parent
    path = {
        "PATH": f"{bin_folder}:{os.environ['PATH']}",
        "MPLBACKEND": "agg",
        "SOURCE_DATE_EPOCH": "0",
    }
    command = command.replace("source .venv/bin/activate\n", "")
    return subprocess.run(
        ["/bin/bash", "-ec", command],
        cwd=folder,
        env=os.environ | path,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    ).stdout


def main(folder: Path) -> None:
    """Draw all pictures into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "loop.svg").write_text(loop(), "utf-8")
    with tempfile.TemporaryDirectory() as work:
        ball, hand, chains = (Path(work) / name for name in ("ball", "hand", "chains"))
        for place in (ball, hand, chains):
            place.mkdir()
        carry_out(first_block("README.md", "sh", "rig analyze"), ball)
        results = json.loads(carry_out("rig analyze my.session --json", ball))
        (folder / "card.svg").write_text(card(results), "utf-8")
        screenshot(ball / "my-report.html", folder / "report.png")
        carry_out(first_block("docs/build.md", "sh", "rig new"), hand)
        for drawing in ("mounting", "wiring"):
            shutil.copyfile(hand / f"my-ball-{drawing}.svg", folder / f"{drawing}.svg")
        carry_out(first_block("docs/tutorial.md", "sh", "rig new"), chains)
        (chains / "figure.py").write_text(first_block("docs/python.md", "python", "savefig"))
        (chains / "matplotlibrc").write_text("svg.hashsalt: rig\n")  # or ids change every time
        carry_out("python figure.py", chains)
        shutil.copyfile(chains / "separation.svg", folder / "separation.svg")
    for path in sorted(folder.iterdir()):
        print(f"{path}: {path.stat().st_size / 1024:.0f} KiB")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs/pictures")
