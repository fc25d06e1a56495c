"""The pour from Python: plan it, run it with another cup, and evaluate its log with numpy."""

from pathlib import Path

import numpy as np

import manipcli

TASK = Path(__file__).parents[2] / "tasks" / "pour.yaml"
LOG = Path("runs/pour_in_python.mcap")
CHANGES = ["scene.cup.mass=200 g", "scene.cup.friction=0.8"]

task = manipcli.load_task(TASK, overrides=CHANGES)
plan = manipcli.plan_task(task)
for step in plan.steps:
    print(f"{step.id:10} {step.plan.duration:6.2f} s in {len(step.plan.motions)} motions")

LOG.parent.mkdir(exist_ok=True)
report = manipcli.run_task(TASK, overrides=CHANGES, log=LOG, force=True)
print(f"{report.verdict.verdict}: {report.verdict.simulated_time:.2f} s at {report.real_time_factor:.1f} x real time")

recording = manipcli.read_recording(LOG)
states = recording.states
cup, ball = (recording.body_names.index(name) for name in ("cup", "ball"))
x, y, z, w = states.body_quat_xyzw[:, cup].T
tilt = np.degrees(np.arccos(np.clip(1 - 2 * (x**2 + y**2), -1, 1)))
apart = np.linalg.norm(states.body_position[:, ball] - states.body_position[:, cup], axis=1)
out = states.time[np.argmax(apart > 0.12)]
arm = next(trace for trace in recording.controllers if trace.name == "arm_controller")
error = np.abs(arm.reference_position - arm.position)
print(f"highest cup      {1000 * np.ptp(states.body_position[:, cup, 2]):6.0f} mm above the desk")
print(f"greatest tilt    {tilt.max():6.1f} deg at {states.time[tilt.argmax()]:.2f} s")
print(f"ball out of cup  {out:6.2f} s")
print(f"worst joint      {np.degrees(error.max()):6.2f} deg off: {arm.joints[int(error.max(axis=0).argmax())]}")
