"""A control tick keeps Python's interpreter lock.

Whoever lets go of it for an instant wakes the thread that waits for it, and takes it back before that has begun: the
tick pays for the waking, and the recorder's thread gets no turn. A thread that waits all the time shows it: with a long
switch interval it goes to sleep again as often as it was woken.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from manipcli.control.action import GripperGoal
from manipcli.control.roles import is_follower, is_hand
from manipcli.plan.trajectory import JointTrajectory
from manipcli.run.execute import build_manager
from manipcli.simulate.engine import EngineSettings
from manipcli.simulate.engines import ENGINES
from manipcli.simulate.session import Session
from manipcli.task.load_task import load_task
from manipcli.task.plan_task import plan_task

HOME = Path(__file__).parents[2] / "tasks" / "home.yaml"
COUNT = "\nvoluntary_ctxt_switches:"
TICKS = 300
FEW = TICKS / 10
STATUS = Path("/proc/thread-self/status")

pytestmark = pytest.mark.skipif(not STATUS.exists(), reason="the kernel does not count how often a thread slept")


@contextmanager
def waiting_thread() -> Iterator[Callable[[], int]]:
    """A thread that always waits for the lock; how often it went to sleep so far."""
    ids: list[int] = []
    over = threading.Event()

    def wait() -> None:
        ids.append(threading.get_native_id())
        while not over.is_set():
            time.sleep(0)

    thread = threading.Thread(target=wait)
    before = sys.getswitchinterval()
    thread.start()
    while not ids:
        time.sleep(0.001)
    status = os.open(f"/proc/self/task/{ids[0]}/status", os.O_RDONLY)
    sys.setswitchinterval(1000.0)
    try:
        yield lambda: int(os.pread(status, 1 << 16, 0).decode().split(COUNT)[1].split()[0])
    finally:
        sys.setswitchinterval(before)
        over.set()
        os.close(status)
        thread.join()


@pytest.fixture
def session() -> Iterator[Session]:
    task = load_task(HOME)
    settings = EngineSettings(step=0.001, substeps=1, start=plan_task(task).start.position)
    engine = ENGINES["pybullet"].open(task.robot, task.scene, settings)
    yield Session(robot=task.robot, scene=task.scene, engine=engine, manager=build_manager(task), period=0.001)
    engine.close()


def woken(slept: Callable[[], int], act: Callable[[], object]) -> int:
    """How often the thread was woken while `act` was called so many times; several times at once count once."""
    before = slept()
    for _ in range(TICKS):
        act()
    return slept() - before


def test_the_measure_tells_who_lets_go() -> None:
    numbers = np.ones(10)

    def work(product: Callable[..., object]) -> None:
        product(numbers, numbers)
        sum(range(1000))

    with waiting_thread() as slept:
        assert any(woken(slept, lambda: work(np.dot)) > FEW for _ in range(50))  # at once where a core is free
        assert woken(slept, lambda: work(np.vdot)) < FEW


def test_a_tick_keeps_the_lock(session: Session) -> None:
    for controller in session.manager.controllers:
        if is_follower(controller):
            zero = np.zeros((1, len(controller.joints)))
            controller.send_goal(JointTrajectory.of_arrays(controller.joints, np.array([3.0]), zero))
        elif is_hand(controller):
            controller.send_goal(GripperGoal(target=np.full(len(controller.joints), 0.5), force=3.0))
    session.tick()  # samples the whole trajectory, for which it may let go
    with waiting_thread() as slept:
        assert woken(slept, session.tick) < FEW
