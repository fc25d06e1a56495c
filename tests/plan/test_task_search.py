"""The search over the steps of a task: against brute force, and on tasks whose first grasp leads to nothing."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace as replaced
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from manipcli.core.errors import NotPlannable
from manipcli.core.geometry import Array, Transform, frozen
from manipcli.model.collision import Carried
from manipcli.pipeline import run_task
from manipcli.plan.candidates import ELSEWHERE, Candidate, Candidates, Decision
from manipcli.plan.cost import CLEARANCE_WEIGHT, GRASP_WEIGHT, LIMIT_WEIGHT, SINGULARITY_WEIGHT, step_cost
from manipcli.plan.motion import Motion, PlanningState, StepPlan
from manipcli.plan.planner import Planner
from manipcli.plan.task_search import MOST, search_task
from manipcli.run import replan
from manipcli.spec.step import StepSpec
from manipcli.task.load_task import load_task
from manipcli.task.plan_steps import plan_step
from manipcli.task.plan_task import Plan, plan_task
from manipcli.task.task import Task

ROOT = Path(__file__).parents[2]
PANDA = f"robot: {ROOT}/robots/panda/robot.yaml\ncontrollers: {ROOT}/controllers/panda.yaml\n"
SCENE = """scene:
  table: {box: {size: [0.6, 0.8, 0.2]}, pose: {xyz: [0.55, 0, 0.1]}, fixed: true}
  block: {box: {size: [4 cm, 4 cm, 10 cm]}, mass: 80 g, rests_on: table, at: [0.5, -0.15], friction: 0.9}
  far: {box: {size: [0.2, 0.2, 0.2]}, pose: {xyz: [1.5, 0, 0.1]}, fixed: true}
  bin: {tray: {size: [0.2, 0.2, 0.09]}, rests_on: table, at: [0.5, 0.2], fixed: true}
"""
PICK = "  - pick: {object: block}\n"
LIFT = "  - lift: {object: block, by: 15 cm}\n"
PLACE = "  - place: {object: block, at: [0.5, 0.2], onto: bin}\n"


def task_of(folder: Path, steps: str, head: str = "") -> Task:
    file = folder / "task.yaml"
    file.write_text(f"task: t\n{PANDA}{head}{SCENE}steps:\n{steps}")
    return load_task(file, allow_outside=True)


def tool(plan: Plan, end: PlanningState) -> Array:
    """R_WT at the end of a step."""
    return plan.planner.tool_pose(end).R


def angle(one: Array, other: Array) -> float:
    """Between two orientations [deg]."""
    return float(np.degrees(np.arccos(np.clip((np.trace(one.T @ other) - 1.0) / 2.0, -1.0, 1.0))))


def test_what_cannot_be_lifted_as_it_is_held_is_taken_otherwise(tmp_path: Path) -> None:
    lift = task_of(tmp_path, PICK + LIFT).spec.steps[1]
    alone = plan_task(task_of(tmp_path, PICK))
    end = alone.steps[0].plan.end
    with pytest.raises(NotPlannable, match="cannot lift"):
        plan_step(alone.planner, lift, end)
    whole = plan_task(task_of(tmp_path, PICK + LIFT + PLACE))
    assert [step.verb for step in whole.steps] == ["pick", "lift", "place"]
    used, left = tool(whole, whole.steps[0].plan.end), whole.steps[0].grasps
    assert angle(left[0], tool(alone, end)) < 0.1
    assert min(angle(used, one) for one in left) > 40.0
    # From where it is measured it is taken by none of these either, as long as it is taken by the same step.
    away = Transform.of(xyz=(0.01, -0.01, 0.0)) @ whole.start.bodies[0]
    moved = PlanningState(whole.start.position, (away,))
    again = plan_step(whole.planner, task_of(tmp_path, PICK).spec.steps[0], moved, left)
    assert angle(tool(whole, again.end), used) < 0.1


def test_only_what_depends_on_the_grasp_is_planned_again_and_not_for_ever(tmp_path: Path) -> None:
    """The refusal is that of the step that came furthest, and tells how many grasps there were."""
    task = task_of(
        tmp_path, "  - move: {to: home}\n" + PICK + LIFT + "  - place: {object: block, at: [1.5, 0.0], onto: far}\n"
    )
    told: list[str] = []
    with pytest.raises(NotPlannable) as refused:
        plan_task(task, on_progress=told.append)
    assert told[0].startswith("planning step 1 of 4") and not any(
        one.startswith("planning step 1 ") for one in told[1:]
    )
    told = [one for one in told if ": candidate" not in one]
    tried = 1 + sum("'pick_1': another candidate" in one for one in told)
    assert 2 < tried <= MOST + 1
    picked = sum(
        before.startswith("planning step 2") and not after.startswith("planning step 2")
        for before, after in itertools.pairwise(told)
    )
    assert refused.value.step == "place_1"
    assert refused.value.cause.endswith(f"; {picked} grasps of the object were tried")
    assert refused.value.place is not None and refused.value.place.line == 13


def test_no_other_grasp_is_tried_for_a_value_that_is_wrong_with_each(tmp_path: Path) -> None:
    told: list[str] = []
    place = "  - place: {object: block, at: [1.5, 0.0], onto: table}\n"
    task = task_of(tmp_path, PICK.replace("block", "block, approach: {from: top}") + LIFT + place)
    with pytest.raises(NotPlannable) as refused:
        plan_task(task, on_progress=told.append)
    assert len({one.partition(":")[0] for one in told}) == 3
    assert refused.value.cause == "[1.5, 0] m is outside 'table', whose centre is at [0.55, 0] m"
    assert refused.value.hint == "`at` is in the world frame; 'table' offers 0.6 m x 0.8 m about its centre"
    assert refused.value.place is not None and (refused.value.place.line, refused.value.place.column) == (
        12,
        place.index("[") + 1,
    )


def test_a_refusal_with_an_empty_hand_or_of_the_only_grasp_is_told_as_it_is(tmp_path: Path) -> None:
    told: list[str] = []
    for steps in (
        "  - move: {pose: {xyz: [2, 0, 1]}}\n",
        PICK + "  - release: {}\n  - move: {pose: {xyz: [2, 0, 1]}}\n",
    ):
        with pytest.raises(NotPlannable) as refused:
            plan_task(task_of(tmp_path, steps), on_progress=told.append)
        assert "grasps" not in refused.value.cause
    assert not any("another candidate" in one for one in told)


def test_a_step_that_is_tried_with_other_values_may_use_every_grasp(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    used: list[Sequence[Array]] = []

    def watched(planner: Planner, step: StepSpec, now: PlanningState, grasps: Sequence[Array] = ()) -> StepPlan:
        if step.verb == "pick":
            used.append(grasps)
        return plan_step(planner, step, now, grasps)

    monkeypatch.setattr(replan, "plan_step", watched)
    for changed in (True, False):
        used.clear()
        pick = "  - pick: {object: block, approach: {distance: $distance}}\n"
        never = "    until: {at_pose: {pose: home}}\n    timeout: 3 s\n"
        retry = f"    on_fail: {{retry: 1{', with: {distance: 12 cm}' if changed else ''}}}\n"
        head = "params: {distance: 10 cm}\nsimulation: {engine: kinematic}\n"
        assert plan_task(task_of(tmp_path, pick + never + retry + LIFT, head)).steps[0].grasps
        run_task(tmp_path / "task.yaml", log=tmp_path / "log.mcap", force=True, allow_outside=True)
        assert used and all(bool(grasps) != changed for grasps in used)


@pytest.mark.parametrize("seed", range(200))
def test_the_search_finds_a_plan_if_brute_force_finds_one(seed: int) -> None:
    """Steps that take, carry and set down; whether one has a plan depends on the grasp of what it carries, and on where
    the body in its way was set down. The oracle tries all combinations."""
    rng = np.random.default_rng(seed)
    count, ways = 6, 3
    verbs = ["pick", "carry", "place"] * 2
    legal = {k: rng.random((ways, ways, ways)) < 0.45 for k in range(count)}

    def fits(k: int, way: int, grasp: int, place: int) -> bool:
        return bool(legal[k][way, grasp if verbs[k] != "pick" else 0, place if k >= 3 else 0])

    def possible(k: int, grasp: int, place: int) -> bool:
        if k == count:
            return True
        return any(
            fits(k, way, grasp, place)
            and possible(k + 1, way if verbs[k] == "pick" else grasp, way if k == 2 else place)
            for way in range(ways)
        )

    def opens(k: int, state: PlanningState) -> Candidates:
        grasp, place = (int(x) for x in state.position)
        first_one = Carried("one", "hand", Transform.identity())

        def attempt(way: int) -> StepPlan:
            if not fits(k, way, grasp, place):
                raise NotPlannable("no", parts=frozenset({"one"}))
            carried = None if verbs[k] == "place" else replaced(first_one, body="one" if k < 3 else "two")
            now = [way if verbs[k] == "pick" else grasp, way if k == 2 else place]
            return StepPlan((), PlanningState(frozen(now), (), carried=carried))

        decides: dict[str, Decision] = {"pick": "grasp", "carry": "nothing", "place": "place"}
        options = [Candidate(partial(attempt, way), name=str(way)) for way in range(ways)]
        return Candidates(options, what=f"step {k}", decides=decides[verbs[k]])

    start = PlanningState(frozen([0.0, 0.0]), ())
    if possible(0, 0, 0):
        assert len(search_task(opens, count, start)) == count
    else:
        with pytest.raises(NotPlannable):
            search_task(opens, count, start)


def test_what_cannot_be_picked_where_it_was_put_is_put_elsewhere_in_the_region(tmp_path: Path) -> None:
    """At the far places in the region the arm cannot take it from the other side; the nearest to the centre are far."""
    region = "region: {box: {centre: [0.74, 0.0], size: [0.6, 0.3]}}"
    scene = SCENE.replace("[0.6, 0.8, 0.2]}, pose: {xyz: [0.55", "[1.4, 0.8, 0.2]}, pose: {xyz: [0.95").split("  far:")[
        0
    ]
    steps = (
        "  - pick: {object: block, approach: {from: side, yaw: 90 deg}}\n"
        "  - lift: {object: block, by: 10 cm}\n"
        f"  - place: {{object: block, onto: table, {region}}}\n"
        "  - move: {to: home}\n"
    )
    again = "  - pick: {object: block, approach: {yaw: 130 deg}, grasp: {height: 8 cm}}\n"
    file = tmp_path / "task.yaml"
    plans = []
    for tail in ("", again):
        file.write_text(f"task: t\n{PANDA}{scene}steps:\n{steps}{tail}")
        plans.append(plan_task(load_task(file, allow_outside=True)))
    (first,), (other,) = (plan.steps[2].plan.end.bodies for plan in plans)
    assert abs(other.p[0] - 0.74) <= 0.3 and abs(other.p[1]) <= 0.15
    assert max(abs(other.p[:2] - first.p[:2]) / [0.6, 0.3]) >= ELSEWHERE - 1e-9
    assert other.p[0] < first.p[0] - 0.05


@pytest.mark.slow
def test_the_block_that_was_taken_otherwise_lies_in_the_bin(tmp_path: Path) -> None:
    task_of(tmp_path, PICK + LIFT + PLACE + "expect:\n  - inside: {object: block, of: bin}\n")
    report = run_task(tmp_path / "task.yaml", log=tmp_path / "log.mcap", allow_outside=True)
    assert report.verdict.verdict == "passed", report.verdict.text


def costly(durations: Sequence[float] | Array, decides: Decision = "nothing") -> Candidates:
    """Candidates whose plans take these times; a negative one has no plan."""

    def plan(duration: float) -> StepPlan:
        if duration < 0.0:
            raise NotPlannable("no plan")
        return StepPlan((Motion("wait", None, None, duration),), PlanningState(np.zeros(1), (), at_start=False))

    return Candidates([Candidate(partial(plan, duration)) for duration in durations], what="no", decides=decides)


@pytest.mark.parametrize("seed", range(12))
def test_many_further_candidates_find_the_cheapest_plan_and_few_never_a_dearer_one(seed: int) -> None:
    """Steps whose costs are independent: the cheapest plan is the sum of the least durations."""
    rng = np.random.default_rng(seed)
    tables = [np.round(rng.uniform(-2.0, 9.0, int(rng.integers(1, 6))), 3) for _ in range(4)]
    for table in tables:
        table[-1] = abs(table[-1])
    start = PlanningState(np.zeros(1), ())

    def total(optimise: int) -> float:
        solved = search_task(lambda k, _: costly(tables[k]), len(tables), start, optimise=optimise)
        return sum(one.chosen.plan.duration for one in solved)

    found = [total(optimise) for optimise in (0, 1, 3, 10, 1000)]
    assert found == sorted(found, reverse=True)
    assert found[0] == pytest.approx(sum(next(x for x in table if x >= 0.0) for table in tables))
    assert found[-1] == pytest.approx(sum(min(x for x in table if x >= 0.0) for table in tables))


def test_a_further_candidate_is_followed_by_plans_of_its_own_for_the_later_steps() -> None:
    """The second step is quick only after the slow candidate of the first; after the third there is no plan at all."""

    def ends(value: float, duration: float) -> Candidate:
        state = PlanningState(np.array([value]), (), at_start=False)
        return Candidate(lambda: StepPlan((Motion("wait", None, None, duration),), state))

    def opens(k: int, state: PlanningState) -> Candidates:
        if k == 0:
            return Candidates([ends(0.0, 1.0), ends(1.0, 2.0), ends(2.0, 0.1)], what="first")
        before = float(state.position[0])
        if before == 2.0:
            return Candidates([], what="nothing follows")
        return Candidates([ends(before, 1.0 if before == 1.0 else 5.0)], what="second")

    def durations(optimise: int) -> list[float]:
        solved = search_task(opens, 2, PlanningState(np.zeros(1), ()), optimise=optimise)
        return [one.chosen.plan.duration for one in solved]

    assert durations(0) == [1.0, 5.0]
    assert durations(5) == [2.0, 1.0]


def test_a_task_is_planned_cheaper_and_twice_the_same(tmp_path: Path) -> None:
    plans = [plan_task(task_of(tmp_path, PICK, head=f"plan: {{optimise: {n}}}\n")) for n in (0, 8, 8)]
    costs = [step_cost(plan.planner, plan.steps[0].plan) for plan in plans]
    assert costs[1].total < costs[0].total
    ends = [plan.steps[0].plan.end.position for plan in plans]
    assert np.array_equal(ends[1], ends[2])
    for cost in costs:
        assert cost.total >= cost.duration > 0.0
        assert 0.0 <= cost.clearance <= CLEARANCE_WEIGHT
        assert 0.0 <= cost.limits <= LIMIT_WEIGHT
        assert 0.0 <= cost.singularity <= SINGULARITY_WEIGHT
        assert 0.0 < cost.grasp <= GRASP_WEIGHT


def test_plans_of_a_robot_without_a_tool_are_compared(tmp_path: Path) -> None:
    """It has no singularity of a tool; its plan is the only one."""
    own = ROOT / "examples" / "04_own_robot"
    robot = (own / "robot.yaml").read_text(encoding="utf-8").replace("reacher.urdf", f"{own}/reacher.urdf")
    robot = robot.replace("{chain: {base: base, tip: fore}}", "{joints: [pan, shoulder, elbow]}")
    (tmp_path / "robot.yaml").write_text(robot, encoding="utf-8")
    task = (own / "task.yaml").read_text(encoding="utf-8").replace("controllers.yaml", f"{own}/controllers.yaml")
    (tmp_path / "task.yaml").write_text(task, encoding="utf-8")
    plans = [
        plan_task(load_task(tmp_path / "task.yaml", overrides=[f"plan.optimise={n}"], allow_outside=True))
        for n in (0, 2)
    ]
    assert plans[0].planner.robot.tool is None
    assert [each.duration for each in plans[0].motions] == [each.duration for each in plans[1].motions]
