"""Pick a cup, set it down elsewhere and go home, as a client of a running robot."""

import queue
import subprocess
import sys
from pathlib import Path

import roslibpy

TASK = Path(__file__).parents[2] / "tasks/pour.yaml"
STEPS = (
    "{pick: {object: cup, approach: {from: side, distance: 10 cm}, grasp: {posture: wrap, force: 8 N, height: 68 mm}}}",
    "{lift: {object: cup, by: 10 cm}}",
    "{place: {object: cup, onto: desk, at: [0.72, -0.15]}}",
    "{move: {to: home}}",
    "{pick: {object: cop, grasp: {posture: wrap}}}",
)


def main() -> None:
    command = [sys.executable, "-m", "manipcli", "serve", str(TASK), "--port", "0", "--speed", "max", "--open"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    url = next(line for line in server.stdout if line.startswith("ws://"))
    robot = roslibpy.Ros(url.strip())
    robot.run()
    action = roslibpy.ActionClient(robot, "/task/run_step", "manipcli_msgs/action/RunStep")
    for step in STEPS:
        results = queue.Queue()
        action.send_goal(roslibpy.Goal({"step": step}), results.put, print_phase, results.put)
        result = results.get()["values"]
        margin = f", margin {result['margin']:.3g} {result['unit']}" if result["margin"] is not None else ""
        print(f"{result['id'] or 'step'}: {result['outcome']}{margin}")
        if result["outcome"] != "done":
            print(result["text"])
    robot.terminate()
    server.terminate()
    server.wait()


def print_phase(feedback: roslibpy.core.Feedback) -> None:
    print("  ", feedback["phase"])


if __name__ == "__main__":
    main()
