"""Who feeds whom, against the files: nothing is in the graph that is not in the task, the controllers or the log."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader

from manipcli.cli.app import main
from manipcli.logs.graph import PRODUCERS, log_graph, task_graph
from manipcli.pipeline import run_task
from manipcli.record.channels import channel_table
from manipcli.report.logs.graph import Graph

ROOT = Path(__file__).parents[2]
TASK = (
    "task: nod\nrobot: {root}/robots/differential_wrist/robot.yaml\ncontrollers: controllers.yaml\n"
    "simulation: {{engine: {engine}, control_period: 4 ms}}\n{more}"
    "steps:\n  - move: {{to: {{pitch: 0.2}}}}\n  - wait: 0.1 s\n"
)
CONTROLLERS: dict[str, dict[str, object]] = {
    "wrist": {"type": "joint_trajectory", "joints": ["pitch", "roll"], "command_interface": "position"},
    "wrist_effort": {
        "type": "joint_trajectory",
        "joints": ["pitch", "roll"],
        "command_interface": "effort",
        "gains": {"pitch": {"p": 6, "d": 0.2}, "roll": {"p": 3, "d": 0.1}},
        "active": False,
        "update_rate": 125.0,
    },
    "feel": {"type": "force_torque_broadcaster", "link": "hand"},
}

SENSORS = "sensors: {encoder: {type: joint}, scanner: {type: range, rate: 50 Hz}}\n"


@pytest.fixture
def task(tmp_path: Path) -> Callable[..., Path]:
    """Writes a task with two controllers, of which one waits, and a sensor."""

    def write(engine: str = "kinematic", more: str = "") -> Path:
        (tmp_path / "controllers.yaml").write_text(yaml.safe_dump({"controllers": CONTROLLERS}, sort_keys=False))
        path = tmp_path / "nod.yaml"
        path.write_text(TASK.format(root=ROOT, engine=engine, more=more))
        return path

    return write


def _edges(graph: Graph) -> set[tuple[str, str]]:
    return {(edge.source, edge.target) for edge in graph.edges}


def test_every_topic_of_the_table_has_a_producer() -> None:
    assert {channel.topic for channel in channel_table([], scene_joints=True)} == set(PRODUCERS)


def test_the_graph_of_a_task_is_what_its_files_say(task: Callable[..., Path]) -> None:
    graph = task_graph(task("pybullet"))
    nodes = {node.id: node for node in graph.nodes}
    assert len(nodes) == len(graph.nodes)
    assert all(edge.source in nodes and edge.target in nodes for edge in graph.edges)
    made = {node.name: node for node in graph.nodes if node.kind == "controller"}
    assert list(made) == list(CONTROLLERS)
    assert [made[name].idle for name in made] == [not one.get("active", True) for one in CONTROLLERS.values()]
    assert ["125 Hz" in node.details for node in made.values()] == [False, True, False]
    assert ["250 Hz" in node.details for node in made.values()] == [True, False, True]
    assert nodes["task"].items == ("move_1: move", "wait_1: wait")
    edges = _edges(graph)
    # What follows trajectories gets them, what commands joints goes through limits, a sensor does neither.
    assert {b for a, b in edges if a == "planner"} == {"wrist", "wrist_effort"}
    assert {a for a, b in edges if b == "limits"} == {"wrist", "wrist_effort"}
    # Its motors have limits and friction: efforts go through them, positions to the engine's own motors.
    assert {b for a, b in edges if a == "limits"} == {"drives", "engine"}
    assert ("drives", "engine") in edges
    assert "1 DifferentialTransmission" in nodes["drives"].details[0]
    assert {b for a, b in edges if a == "wrench feel"} == {"feel"}
    assert ("joints", "feel") not in edges
    ideal = _edges(task_graph(task("kinematic")))
    assert ("limits", "drives") not in ideal, "without physics no actuator acts"
    assert ("limits", "engine") in ideal


def test_sensors_are_where_the_files_say_and_feed_who_reads_them(task: Callable[..., Path], tmp_path: Path) -> None:
    sensors = {
        "force": {"type": "force_torque", "link": "hand", "rate": "125 Hz", "delay": "8 ms"},
        "encoder": {"type": "joint", "joints": ["pitch"]},
        "scanner": {"type": "range", "at": {"xyz": [1, 0, 0]}, "rays": 3, "rate": "10 Hz"},
    }
    path = task("pybullet", f"sensors: {json.dumps(sensors)}\n")
    controllers = CONTROLLERS | {"feel": {"type": "force_torque_broadcaster", "sensor": "force"}}
    (tmp_path / "controllers.yaml").write_text(yaml.safe_dump({"controllers": controllers}, sort_keys=False))
    graph = task_graph(path)
    edges = _edges(graph)
    nodes = {node.name: node for node in graph.nodes if node.kind == "sensor"}
    assert nodes["force"].details == ("force_torque", "on hand", "125 Hz", "8 ms late")
    assert nodes["encoder"].details == ("joint", "1 joint", "250 Hz")
    assert nodes["scanner"].details == ("range", "in world", "10 Hz")
    readers = {name: {b for a, b in edges if a == node.id} for name, node in nodes.items()}
    assert readers["force"] == {"feel", "/sensors/force"}
    assert readers["encoder"] == {"wrist", "wrist_effort", "/sensors/encoder"}
    assert readers["scanner"] == {"/sensors/scanner"}
    assert ("joints", "wrist") in edges, "of roll they get the truth"
    asks = f"sensors: {json.dumps(sensors)}\nexpect: [wrench: {{sensor: force, force: {{axis: z, above: 5 N}}}}]\n"
    assert ("sensor force", "task") in _edges(task_graph(task("pybullet", asks)))
    both = {**sensors, "encoder": {"type": "joint"}}
    assert ("joints", "wrist") not in _edges(task_graph(task("pybullet", f"sensors: {json.dumps(both)}\n")))


def test_the_topics_of_a_task_are_those_of_its_log(task: Callable[..., Path], tmp_path: Path) -> None:
    path = task(
        "kinematic", "record: {topics: [tf, controller_state, contacts, sensors], rates: {tf: 125 Hz}}\n" + SENSORS
    )
    before = {node.name: node for node in task_graph(path).nodes if node.kind == "topic"}
    log = tmp_path / "nod.mcap"
    run_task(path, log=log)
    graph = log_graph(log)
    after = {node.name: node for node in graph.nodes if node.kind == "topic"}
    with log.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    written = {channel.topic: k for k, channel in summary.channels.items()}
    assert set(before) == set(after) == set(written)
    assert "/actuator_states" not in before
    for name, k in written.items():
        count = summary.statistics.channel_message_counts.get(k, 0)
        assert after[name].details[0].startswith(f"{count} message")
        assert after[name].type == before[name].type == summary.schemas[summary.channels[k].schema_id].name
    assert before["/sensors/scanner"].details == ("50 Hz",)
    assert before["/tf"].details == ("125 Hz",)
    assert ", 125 Hz" in after["/tf"].details[0]
    without = {(a, b) for a, b in _edges(graph) if b not in after}
    assert without == {(a, b) for a, b in _edges(task_graph(path)) if b not in before}
    assert all(sum(b == name for _, b in _edges(graph)) == 1 for name in after), "one publisher each"


@pytest.mark.slow
def test_the_command_takes_tasks_and_logs(
    task: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = task()
    log = tmp_path / "nod.log"
    run_task(path, log=log)
    for file in (path, log):
        assert main(["graph", str(file)]) == 0
        assert "└─ controller wrist_effort" in capsys.readouterr().out
        assert main(["graph", str(file), "--format", "json"]) == 0
        assert json.loads(capsys.readouterr().out)["name"] == "nod"
    assert main(["graph", str(tmp_path / "absent.yaml")]) == 4
    assert main(["graph", str(tmp_path / "absent.mcap")]) == 4
    (tmp_path / "broken.mcap").write_text("hello")
    assert main(["graph", str(tmp_path / "broken.mcap")]) == 4


def test_of_a_foreign_log_the_topics_alone_are_told(
    task: Callable[..., Path], tmp_path: Path, rewrite_log: Callable[..., Path]
) -> None:
    log = tmp_path / "nod.mcap"
    run_task(task(), log=log)
    graph = log_graph(rewrite_log(log, tmp_path / "foreign.mcap", metadata=lambda name, _: None))
    assert {node.kind for node in graph.nodes} == {"topic"}
    assert graph.edges == ()
    assert "not written by manipcli" in graph.notes[0]
