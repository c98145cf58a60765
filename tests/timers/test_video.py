"""A tracked video of the same fall, beside what the gates say."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from rig.analysis.video import video_fall
from rig.cli import main
from rig.errors import InputError
from rig.timers.video import read_video

BALL = Path(__file__).parents[2] / "protocols/falling-ball.yaml"
G = 9.81


def tracked(path: Path, heading: str = "#mass A\nt\tx\ty", scale: float = 1.0) -> Path:
    """Twelve frames at 60 a second of a fall, in a tilted picture, read to 0.5 mm."""
    rng = np.random.default_rng(3)
    lines = [heading]
    for k in range(12):
        way = 0.5 * G * (k / 60 + 0.02) ** 2
        x, y = way * np.array([0.1, -math.sqrt(0.99)]) + rng.normal(0, 5e-4, 2)
        lines.append(f"{5.4 + k / 60:.6f}\t{x * scale:.6f}\t{y * scale:.6f}")
    path.write_text("\n".join(lines), "utf-8")
    return path


def test_a_tilted_picture_gives_the_acceleration_with_what_its_frames_allow(tmp_path):
    for heading, scale in (("#mass A\nt\tx\ty", 1.0), ("t (s)\tx (cm)\ty (cm)", 100.0)):
        found = video_fall(*read_video(tracked(tmp_path / "track.txt", heading, scale))[:3])
        assert found.frames == 12
        assert not found.bent
        assert abs(found.acceleration.value - G) < found.acceleration.expanded
        assert found.acceleration.u < 0.2


def test_frames_of_something_else_than_a_fall_are_noticed():
    times = np.arange(20) / 30
    assert video_fall(times, 0 * times, np.abs(times - 0.3)).bent  # down and up again


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("run,channel,time_s,state\n1,0,0.1,1\n", "no columns t, x and y"),
        ("t,x,y\n0,1,2\n", "1 frames"),
        ("t,x,y\n0,1,2\n0.1,a,2\n", ":3:5: x: 'a' is not a number"),
        ("t,x,y\n0,1,2\n0.1,a,b\n", ":3:7: y: 'b' is not a number"),
        ("t,x,y\n0,1,2\n0.1,1,2\nt,x,y\n0.2,1,2\n", "2 frames"),
        ("t (s),x (px),y (px)\n0,1,2\n0.1,1,2\n", "'px' is not a unit of this column"),
    ],
)
def test_other_files_are_refused_with_their_reason(tmp_path, text, said):
    path = tmp_path / "track.csv"
    path.write_text(text, "utf-8")
    with pytest.raises(InputError) as caught:
        read_video(path)
    assert said in str(caught.value)


def test_analyze_sets_it_beside_the_gates(tmp_path, capsys):
    rows = ["run,channel,time_s,state"]
    for channel, height in enumerate((0.85, 0.6, 0.35, 0.1)):
        for state, side in ((1, -0.01), (0, 0.01)):
            rows.append(f"1,{channel},{math.sqrt(2 * (0.9 - height + side) / G):.7f},{state}")
    edges, session = tmp_path / "edges.csv", tmp_path / "a.session"
    edges.write_text("\n".join(rows), "utf-8")
    words = f"import {edges} --protocol {BALL} --session {session} --clock-uncertainty 1ppm"
    assert main(words.split()) == 0
    video = tracked(tmp_path / "track.txt")
    video.write_text(2 * f"{video.read_text('utf-8')}\n", "utf-8")
    assert main(["analyze", str(session), "--video", str(video), "--json"]) == 0
    out, err = capsys.readouterr()
    assert "12 rows of the video's file" in err
    assert abs(json.loads(out)["video"]["normalized_error"]) < 1
    assert main(["analyze", str(session), "--video", str(video)]) == 0
    assert "12 frames of a video" in capsys.readouterr().out
