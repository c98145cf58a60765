"""One resolved fall to look at: ``python -m sim.film URL RUN PICTURES`` prints it as JSON.

``times_s``; ``left`` and ``right`` with the ends of every rod at every moment, (T, N, 3) in m;
``rest_m`` with the lengths of both strings above each rod, (2, N − 1); ``radii_m``; ``incline_deg``
and ``board_m``, the height of the board below the chain, counted from the contact level.
"""

from __future__ import annotations

import json
import math
import sys
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.link.messages import pack_label
from rig.ports import read_settings
from rig.protocol import reader
from sim.dials import read_dials
from sim.resolved.fall import fall
from sim.resolved_lab import ResolvedLab
from sim.scene import choose_world

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sim.resolved.scene import Chain


def film(settings: Mapping[str, str], run: int, pictures: int) -> dict[str, Any]:
    """Let the striking chain of a run fall, and take pictures from its first touch to its last."""
    rest = dict(settings)
    protocol = reader.read(rest.pop("protocol"))
    seed = int(rest.pop("seed", "1"))
    world, rest = choose_world(rest)
    lab = world.hang(protocol, read_dials(rest), seed, lambda _: None)
    assert isinstance(lab, ResolvedLab)
    chain = lab.chains(pack_label(run, 1))["impact"]
    (found,) = fall([chain], step=lab.step)
    moments = np.linspace(found.touched_s[0], found.frames_s[-1], pictures)
    taken = np.abs(found.frames_s[:, None] - moments).argmin(axis=0)
    arms = chain.rods.length / 2.0 * found.axes[taken]
    left, right = ((found.places[taken] + side * arms).transpose(0, 2, 1) for side in (-1.0, 1.0))
    # In free fall no string is longer than at rest, and the first touch has not loosened many yet.
    gaps = np.stack([np.linalg.norm(np.diff(ends[0], axis=0), axis=1) for ends in (left, right)])
    return {
        "incline_deg": lab.runs[run].incline_deg,
        "times_s": found.frames_s[taken].tolist(),
        "left": left.tolist(),
        "right": right.tolist(),
        "rest_m": gaps.tolist(),
        "board_m": _board_height(chain),
        "radii_m": (chain.rods.diameters / 2.0).tolist(),
    }


def _board_height(chain: Chain) -> float:
    """How far below an undisturbed rod's middle, as it touches, the board is, m; negative."""
    assert chain.board is not None
    tilt, cos = float(np.abs(chain.rods.tilts).mean()), math.cos(chain.board.incline)
    down = math.sin(tilt) * cos
    rim = float(chain.rods.diameters[-1]) / 2.0 * math.sqrt(1.0 - down**2) / cos
    return -(chain.rods.length / 2.0 * math.sin(tilt) + rim)


if __name__ == "__main__":
    url, run, pictures = sys.argv[1:]
    print(json.dumps(film(read_settings(url), int(run), int(pictures))))
