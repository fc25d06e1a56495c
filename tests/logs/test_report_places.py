"""The page about a run names the lines of the user's own file, and says which sample it is of."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.reader import make_reader

from manipcli.conditions.members.at_pose import AtPoseSpec
from manipcli.conditions.members.contact_force import ContactForceSpec
from manipcli.conditions.members.moved import MovedSpec, UnmovedSpec
from manipcli.conditions.members.near import NearSpec
from manipcli.conditions.members.slip import SlipSpec
from manipcli.logs.report import limit_of, log_page
from manipcli.pipeline import run_task, verify_log
from manipcli.report.html.render_page import render_page
from manipcli.spec.base import Model

ROOT = Path(__file__).parents[2]
TASK = f"""# The wrist waits.

task: short
robot: {ROOT}/robots/differential_wrist/robot.yaml
controllers: {ROOT}/controllers/differential_wrist.yaml
simulation: {{engine: kinematic}}
scene:
  pillar: {{cylinder: {{radius: 1 cm, height: 1 cm}}, fixed: true, pose: {{xyz: [2, 2, 1]}}}}
steps: [{{wait: 50 ms}}]
expect:
  - duration: {{below: 2 s}}
watch:
  - always: {{duration: {{below: 20 ms}}}}
vary:
  scene.pillar.pose.xyz: {{offset: {{uniform: [-1 cm, 1 cm]}}}}
"""


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("places")
    (folder / "mine.yaml").write_text(TASK)
    run_task(folder / "mine.yaml", sample=3, log=folder / "run.mcap")
    return folder / "run.mcap"


@pytest.mark.slow
def test_expectations_and_watches_stand_where_the_user_wrote_them(log: Path) -> None:
    page = log_page(log)
    lines = TASK.splitlines()
    at = [written.place for written in (*page.steps, *page.expectations)]
    told = [lines[int(place.removeprefix("mine.yaml:")) - 1] for place in at]
    assert [line.strip() for line in told] == [
        "steps: [{wait: 50 ms}]", "- duration: {below: 2 s}", "- always: {duration: {below: 20 ms}}"
    ]  # fmt: skip
    assert "task.yaml:" not in render_page(page)


@pytest.mark.slow
def test_expectations_of_every_form_stand_on_the_page(tmp_path: Path) -> None:
    expectations = (
        ("all: [{duration: {below: 2 s}}, {energy: {below: 3 J}}]", None),
        ("any: [{all: [{duration: {below: 2 s}}]}]", None),
        ("not: {duration: {below: 3 s}}", None),
        ("always: {any: [{duration: {below: 3 s}}, {tool_speed: {below: 1 m/s}}]}", None),
        ("never: {duration: {below: 3 s}}", None),
        ("always: {duration: {below: 3 s}}", 3.0),
        ("eventually: {tool_speed: {below: 1 m/s}}", 1.0),
    )
    task = TASK[: TASK.index("watch:")].replace("steps: [{wait: 50 ms}]", "steps: [{wait: 2 ms}]")
    (tmp_path / "mine.yaml").write_text(task + "".join(f"  - {{{text}}}\n" for text, _ in expectations))
    run_task(tmp_path / "mine.yaml", log=tmp_path / "run.mcap")
    page = log_page(tmp_path / "run.mcap")
    assert page.limits == (2.0, *(limit for _, limit in expectations))
    render_page(page)


@pytest.mark.slow
def test_the_page_tells_what_was_drawn(log: Path) -> None:
    page = log_page(log)
    assert page.verdict.drawn is not None
    assert str(page.verdict.drawn).startswith("sample 3: scene.pillar.pose.xyz=[")
    shown = render_page(page)
    assert str(page.verdict.drawn) in shown
    assert "1 value of the sample" in shown


def test_what_ended_before_its_first_tick_has_a_page(log: Path, tmp_path: Path) -> None:
    with log.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    cut = tmp_path / "cut.mcap.partial"
    cut.write_bytes(log.read_bytes()[: summary.chunk_indexes[0].chunk_start_offset + 20])
    page = log_page(cut)
    assert (page.verdict.verdict, page.playback, page.facts) == ("error", None, None)
    assert {cause.at for cause in page.causes} == {None}
    shown = render_page(page)
    assert all(told in shown for told in (page.causes[0].title, "mine.yaml:9", "cut.mcap.partial"))


def test_a_log_is_simulated_again_with_the_places_of_its_run(log: Path) -> None:
    assert verify_log(log).identical


@pytest.mark.parametrize(
    ("spec", "unit", "limit"),
    [
        (SlipSpec(object="cup", within=0.002, rotation=0.005), "m", 0.002),
        (SlipSpec(object="cup", within=0.002, rotation=0.005), "rad", 0.005),
        (UnmovedSpec(object="cup", within=0.002, rotation=0.01), "rad", 0.01),
        (AtPoseSpec(pose="open", within=0.02, slide=0.045), "rad", 0.02),
        (AtPoseSpec(pose="open", within=0.02, slide=0.045), "m", 0.045),
        (AtPoseSpec(pose="open"), "m", 0.005),
        (NearSpec(object="cup", to=(0.0, 0.0, 0.0), within=0.003), "m", 0.003),
        (ContactForceSpec(of="cup", below=20.0), "N", 20.0),
        (ContactForceSpec(of="cup", below=20.0, above=1.0), "N", None),
        (MovedSpec(object="cup", by=0.1, rotation=0.5), "rad", None),
    ],
)
def test_a_limit_is_that_which_the_margin_is_measured_from(spec: Model, unit: str, limit: float | None) -> None:
    assert limit_of(spec, unit) == limit
