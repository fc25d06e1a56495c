"""The page of `view`: on 127.0.0.1 only, for its own page only; sliders and buttons move the robot."""

from __future__ import annotations

import http.client
import socket
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from manipcli.core.errors import InvalidInput
from manipcli.core.geometry import frozen
from manipcli.description.elements import Joint, JointLimits
from manipcli.replay.view.joint_panel import configuration_text
from manipcli.replay.view.joint_slider import slider_range
from manipcli.replay.view.view import View
from manipcli.task.load_view import load_sight

ROOT = Path(__file__).parents[3]
ROBOT = """<robot name="two">
  <link name="base"><visual><geometry><box size="0.2 0.2 0.1"/></geometry></visual></link>
  <link name="finger"/><link name="a/b"/>
  <joint name="drive" type="prismatic"><parent link="base"/><child link="finger"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.1" velocity="1" effort="1"/></joint>
  <joint name="mimic" type="revolute"><parent link="base"/><child link="a/b"/><axis xyz="1 0 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/><mimic joint="drive" multiplier="-2" offset="0.5"/></joint>
</robot>
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[View]:
    path = tmp_path_factory.mktemp("robot") / "two.urdf"
    path.write_text(ROBOT)
    with View(load_sight(path).robot, port=0) as view:
        yield view


def _status(port: int, headers: dict[str, str]) -> int:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    try:
        connection.request("GET", "/", headers=headers)
        return connection.getresponse().status
    finally:
        connection.close()


def _listening() -> set[tuple[str, int]]:
    """(address in hexadecimal, port) of every TCP port that is listened on, as the kernel has it."""
    found = set()
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        for line in Path(table).read_text().splitlines()[1:] if Path(table).exists() else ():
            _, local, _, state = line.split()[:4]
            if state == "0A":
                address, _, port = local.partition(":")
                found.add((address, int(port, 16)))
    return found


def test_it_listens_on_this_machine_only(page: View) -> None:
    assert {address for address, port in _listening() if port == page.port} == {"0100007F"}


def test_it_serves_the_page_to_its_own_browser_only(page: View) -> None:
    own = f"127.0.0.1:{page.port}"
    assert page.url == f"http://{own}"
    assert _status(page.port, {}) == 200
    assert _status(page.port, {"Host": f"localhost:{page.port}"}) == 200
    assert _status(page.port, {"Host": "evil.example"}) == 403  # a name that was bound to 127.0.0.1 after it was opened
    assert _status(page.port, {"Origin": "http://evil.example"}) == 403


def test_no_other_page_gets_the_data(page: View) -> None:
    url, protocols = f"ws://127.0.0.1:{page.port}", [Subprotocol("viser-v0")]
    for origin in ("http://evil.example", "null", f"http://127.0.0.1:{page.port + 1}"):
        with pytest.raises(InvalidStatus) as refused:
            connect(url, origin=Origin(origin), subprotocols=protocols)
        assert refused.value.response.status_code == 403


def test_nobody_can_ask_for_a_tunnel(page: View) -> None:
    assert page.viser.request_share_url() is None


def test_a_port_that_is_taken_is_told(page: View) -> None:
    with pytest.raises(InvalidInput) as refused:
        View(page.robot, port=page.port)
    assert refused.value.findings[0].code == "VIEW001"


def test_nothing_is_printed_and_the_port_is_free_afterwards(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "two.urdf"
    path.write_text(ROBOT)
    with View(load_sight(path).robot, port=0) as view:
        port = view.port
    view.stop()
    assert capfd.readouterr().out == ""
    with socket.socket() as again:
        again.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        again.bind(("127.0.0.1", port))


def test_a_slider_moves_its_joint_and_what_follows_it(page: View) -> None:
    assert [joint.name for joint in page.robot.moving_joints] == ["drive", "mimic"]
    assert list(page.joints.sliders) == [0]  # a mimic joint has none
    page.joints.go(page.joints.named("zero"))
    page.joints.sliders[0].value = 0.04
    _until(lambda: page.joints.position == pytest.approx([0.04, -2 * 0.04 + 0.5]))
    page.joints.go(frozen([0.1, 0.3]))
    assert page.joints.position == pytest.approx([0.1, 0.3])
    assert page.joints.sliders[0].value == pytest.approx(0.1)


def test_a_pose_of_the_hand_leaves_the_arm_alone() -> None:
    sight = load_sight(ROOT / "robots" / "arm7_hand3" / "robot.yaml")
    arm, hand = (sight.robot.indices(sight.robot.group(name).joints) for name in ("arm", "hand"))
    with View(sight.robot, q=sight.q, port=0) as view:
        view.joints.go(view.joints.named("wrap"))
        assert view.joints.position[arm] == pytest.approx(sight.q[arm])
        assert view.joints.position[hand] == pytest.approx(sight.robot.pose("wrap").positions)


def _until(condition: object, seconds: float = 10.0) -> None:
    """Callbacks of the page run in threads of the server."""
    end = time.monotonic() + seconds
    while not condition():  # type: ignore[operator]
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.mark.parametrize(
    ("kind", "lower", "upper", "expected"),
    [
        ("revolute", -1.0, 2.0, (-1.0, 2.0)),
        ("continuous", None, None, (-np.pi, np.pi)),
        ("prismatic", None, None, (-1.0, 1.0)),
        ("prismatic", 4.0, None, (4.0, 5.0)),
        ("prismatic", None, -4.0, (-5.0, -4.0)),
        ("revolute", 0.5, 0.5, (0.5, 0.5)),
    ],
)
def test_a_slider_goes_from_limit_to_limit(
    page: View, kind: str, lower: float | None, upper: float | None, expected: tuple[float, float]
) -> None:
    joint: Joint = replace(page.robot.joints[0], type=kind, limits=JointLimits(lower=lower, upper=upper))  # type: ignore[arg-type]
    assert slider_range(joint) == expected


def test_the_posture_is_told_as_a_robot_file_has_it(page: View) -> None:
    assert configuration_text(page.robot, frozen([0.04, 0.42])) == "drive: 0.04"
