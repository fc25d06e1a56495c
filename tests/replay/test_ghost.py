"""Ghosts: another run, at the times of the shown one."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from manipcli.logs.replay import open_playback
from manipcli.pipeline import run_task
from manipcli.replay.ghost import ghost_of
from manipcli.replay.playback import Playback
from manipcli.replay.player import player_html

ROOT = Path(__file__).parents[2]
FALL = f"""\
task: fall
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
simulation: {{settle: 0 s}}
scene:
  ball: {{sphere: {{radius: 2 cm}}, mass: 50 g, pose: {{xyz: [1, 0, 5]}}}}
steps:
  - wait: 0.2 s
"""


@pytest.fixture(scope="module")
def fall(tmp_path_factory: pytest.TempPathFactory) -> Playback:
    folder = tmp_path_factory.mktemp("fall")
    (folder / "fall.yaml").write_text(FALL)
    run_task(folder / "fall.yaml", log=folder / "fall.mcap")
    return open_playback(folder / "fall.mcap")


def test_a_ghost_falls_with_the_time_of_the_shown_run(fall: Playback) -> None:
    """Oracle: free fall, z = z0 - g t^2 / 2, at the times of a playback with another rate and another end."""
    times = np.linspace(fall.start, fall.end + 0.5, 40)
    shown = replace(fall, times=times)
    ghost = ghost_of("other", fall, shown)
    assert ghost.position.shape == (40, len(fall.joint_names))
    during = times <= fall.end
    rounding = 0.01 * 9.81 * fall.end  # [m] the nearest state is at most 10 ms away (50 Hz), at the speed g t
    z = 5.0 - 9.81 * times**2 / 2.0
    np.testing.assert_allclose(ghost.body[during, 0, 2], z[during], atol=rounding + 0.005)
    np.testing.assert_array_equal(ghost.body[~during, 0, :3], np.tile(fall.body_position[-1, 0], (sum(~during), 1)))


def test_the_player_has_the_ghosts_it_is_given(fall: Playback) -> None:
    def head(page: str) -> dict[str, object]:
        found = re.search(r'data-part="head">(.*?)</script>', page)
        assert found is not None
        parsed: dict[str, object] = json.loads(found[1])
        return parsed

    assert head(player_html(fall))["ghosts"] == []
    shown = head(player_html(fall, ghosts=[ghost_of("mujoco", fall, fall)]))
    ghosts, times = shown["ghosts"], shown["times"]
    assert isinstance(ghosts, list) and isinstance(times, list)
    count = times[2]
    assert 1 < count <= len(fall.times)
    assert [(ghost["name"], ghost["position"][2], ghost["body"][2]) for ghost in ghosts] == [
        ("mujoco", count * len(fall.joint_names), count * 7)
    ]
