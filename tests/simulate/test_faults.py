"""A controller that fails while a task runs: its joints are braked, and the step ends with the cause."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from manipcli.core.errors import SimulationFailed
from manipcli.plan.motion import Motion, Switch
from manipcli.plan.trajectory import JointTrajectory
from manipcli.simulate.executor import Executor
from manipcli.simulate.session import Session

SessionOf = Callable[..., Session]


def move(to: float = 0.5, duration: float = 0.5) -> Motion:
    zero = np.zeros((2, 1))
    way = JointTrajectory.of_arrays(("slide",), np.array([0.0, duration]), np.array([[0.0], [to]]), zero, zero)
    return Motion("go", way, None, duration)


def breaks(session: Session, name: str, at: int, value: float | None = None) -> None:
    """From control tick `at` on this controller raises, or commands `value`."""
    controller: Any = session.manager[name]
    update = controller.update

    def broken(time: float, period: float, measured: Any, *, contact_force: Any = None) -> Any:
        output = update(time, period, measured, contact_force=contact_force)
        if session.ticks >= at:
            if value is None:
                raise RuntimeError("a bug in it")
            output.command[:] = value
        return output

    controller.update = broken


@pytest.mark.parametrize(
    ("who", "modes"), [("arm", ("brake", "effort", "effort")), ("hand", ("effort", "brake", "brake"))]
)
def test_the_motion_fails_with_the_cause_and_the_joints_are_braked(
    session_of: SessionOf, scripted: Any, who: str, modes: tuple[str, ...]
) -> None:
    """Whether the motion is that of the controller that fails or of another one."""
    session = session_of(scripted())
    breaks(session, who, at=50)
    end = Executor(session).run(move(0.05), until=None, deadline=None)
    assert end.outcome == "failed"
    assert end.text.endswith(f"controller '{who}' failed in its update: RuntimeError: a bug in it")
    assert session.ticks == 51
    assert session.manager.command.modes == modes


def test_who_waits_is_told_too(session_of: SessionOf) -> None:
    session = session_of()
    breaks(session, "hand", at=20)
    end = Executor(session).wait(lambda _: False, deadline=1.0)
    assert (end.outcome, session.ticks) == ("failed", 21)
    assert "RuntimeError: a bug in it" in end.text


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_command_that_is_no_finite_number_never_reaches_the_engine(
    session_of: SessionOf, scripted: Any, value: float
) -> None:
    written = []

    class Monitors(scripted):  # type: ignore[misc]
        def write(self, command: Any) -> None:
            written.append((command.modes, command.effort.copy()))

    session = session_of(Monitors())
    breaks(session, "arm", at=50, value=value)
    end = Executor(session).run(move(0.05), until=None, deadline=None)
    assert end.outcome == "failed"
    assert f"controller 'arm' failed in its update: its command for slide/effort is {value}" in end.text
    assert np.isfinite([effort for _, effort in written]).all()
    assert written[-1][0] == ("brake", "effort", "effort")


def test_a_state_that_is_no_number_is_the_fault_of_no_controller(session_of: SessionOf, scripted: Any) -> None:
    def explode(engine: Any) -> None:
        if engine.tick >= 33:
            engine.state.velocity[0] = math.nan

    session = session_of(scripted(explode))
    with pytest.raises(SimulationFailed, match=r"joint 'slide' diverges at nan .* at t = 0\.033 s"):
        Executor(session).hold(0.1)


def test_a_switch_takes_one_tick_and_says_what_came_of_it(session_of: SessionOf) -> None:
    session = session_of()

    def switched(switch: Switch) -> Any:
        return Executor(session).run(Motion("switch", None, None, 0.0, switch=switch), until=None, deadline=None)

    end = switched(Switch(deactivate=("arm",)))
    assert (end.outcome, end.text, session.ticks) == ("done", "deactivated arm", 1)
    end = switched(Switch(deactivate=("arm",)))
    assert (end.outcome, end.text, session.ticks) == ("failed", "cannot deactivate 'arm': it is inactive", 1)
    end = switched(Switch(activate=("arm", "hand"), strictness="best_effort"))
    assert (end.outcome, end.text) == ("done", "activated arm; cannot activate 'hand': it is active")
    end = switched(Switch(to=("arm", "hand")))
    assert (end.outcome, end.text) == ("done", "nothing to switch")
    assert session.manager.command.modes == ("effort",) * 3
