"""``sim://`` as the rest of the program meets it: a port by URL, its line, a device, drops."""

import json
from functools import partial
from pathlib import Path
from typing import NamedTuple

import pytest

from rig.link.messages import pack_label
from rig.records import ClockSample, Drop
from sim.line import BadLine
from tests.link.talk import connected, record_drop, release_drop, url
from tests.sim.falls import PROTOCOLS

HZ = 16_000_000
CHAINS = PROTOCOLS / "inclined-uniform.yaml"
sim_url = partial(url, "sim")


class Talk(NamedTuple):
    """A conversation: all bytes with their times, and what came of it."""

    chunks: list[tuple]
    drops: list[Drop]
    pings: list[ClockSample]


def talk(where: str, gates: int = 0b11, runs=((1, 1),), pings: int = 3) -> Talk:
    done = Talk([], [], [])
    port, device = connected(where, lambda *chunk: done.chunks.append(chunk))
    for i in range(pings):
        port.clock.sleep(0.1 + 0.037 * (i % 7))
        done.pings.append(device.ping())
    for run, attempt in runs:
        order = {"gates": gates, "pulse_us": 80_000, "record_ms": 900}
        done.drops.append(record_drop(device, pack_label(run, attempt), **order))
        release_drop(device, done.drops[-1])
    port.close()
    return done


def test_the_same_seed_gives_the_same_conversation_byte_for_byte():
    one, two, other = (talk(sim_url(seed=seed), runs=((1, 1), (2, 1))) for seed in (3, 3, 4))
    assert one == two
    assert [c for c in one.chunks if c[0] == "rx"] != [c for c in other.chunks if c[0] == "rx"]
    assert one.drops[0].edges != other.drops[0].edges


def truth_lines(file: Path) -> list[dict]:
    return [json.loads(line) for line in file.read_text("utf-8").splitlines()]


def test_the_truth_file_tells_what_is_on_the_wire(tmp_path):
    file = tmp_path / "truth of it.jsonl"
    runs = ((1, 1), (2, 1), (2, 2))
    done = talk(sim_url(CHAINS, seed=5, truth=file, clock="2000 ppm"), 0xFFFF, runs)
    lines = truth_lines(file)
    assert [(line["run"], line["attempt"]) for line in lines] == list(runs)
    assert [(drop.run, drop.attempt) for drop in done.drops] == list(runs)
    for line, drop in zip(lines, done.drops, strict=True):
        assert drop.faults == ()  # no glitches either, so that edges match one to one
        assert len(drop.edges) > 500
        assert sorted(drop.edges) == sorted(
            (round(seconds * HZ * 1.002), channel, blocked)
            for seconds, channel, blocked, _ in line["edges"]
        )
        skew, fall = line["release_skew_s"], line["fall_time_s"]
        raised = 9.81 * (fall * skew - skew**2 / 2)  # a later free chain is higher at the hit
        assert skew != 0
        assert line["separation_raw_m"] == pytest.approx(line["separation_m"] + raised, abs=1e-12)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_bad_line_still_gives_the_whole_drop_once(tmp_path, seed):
    file = tmp_path / "truth.jsonl"
    bad = talk(sim_url(CHAINS, seed=seed, corrupt="0.2 %", lose="0.1 %", truth=file), 0xFFFF)
    clean = talk(sim_url(CHAINS, seed=seed), 0xFFFF)
    assert bad.drops[0].faults == ()
    assert bad.drops[0].edges == clean.drops[0].edges
    assert len(bad.chunks) > len(clean.chunks)  # something had to be said twice
    assert len(truth_lines(file)) == 1  # a repeated FIRE does not let go twice


def test_a_busy_line_changes_only_what_goes_both_ways_at_once():
    line = BadLine(0.0, 0.0, 1.0, seed=1)
    data = bytes(range(100))
    assert line.transfer(data, b"") == (data, b"")
    assert line.transfer(b"", data) == (b"", data)
    changed = line.transfer(data, data)
    assert all(a != b for way in changed for a, b in zip(way, data, strict=True))
