"""Draws the pictures of docs/explanation/ from runs: python docs/scripts/explanation_pictures.py [NAME...]

The commands are those of a user; the pictures are then reduced to 64 colours.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from PIL import Image

ROOT: Final = Path(__file__).resolve().parents[2]
FOLDER: Final = ROOT / "docs" / "explanation"
ARM: Final = "arm_controller/controller_state"
RUNS: Final = {
    "pour": "run tasks/pour.yaml",
    "heavier": "run tasks/pour.yaml --set scene.cup.mass=150.001g",
}
"""Logs, by name."""
PICTURES: Final = {
    "planning_limits": "plan examples/04_own_robot/task.yaml --curves {out}",
    "planning_paths": "plan tasks/clutter.yaml --picture {out}",
    "contact_forces": "plot {pour} contacts.force -o {out}",
    "control_errors": (
        f"plot {{pour}} {ARM}.error.positions[joint_2],{ARM}.error.positions[joint_4],{ARM}.error.positions[joint_6] "
        f"{ARM}.output.effort[joint_2],{ARM}.output.effort[joint_4] -o {{out}}"
    ),
    "determinism_ball": (
        "plot {pour} {heavier} tf[ball].transform.translation.x tf[ball].transform.translation.y -o {out}"
    ),
}
COLOURS: Final = 64


def main(names: list[str]) -> None:
    with TemporaryDirectory() as folder:
        logs = {name: str(Path(folder) / f"{name}.mcap") for name in RUNS}
        chosen = {name: PICTURES[name] for name in names or PICTURES}
        for name, command in RUNS.items():
            if any(f"{{{name}}}" in text for text in chosen.values()):
                _call(f"{command} --log {logs[name]} --quiet")
        for name, command in chosen.items():
            out = FOLDER / f"{name}.png"
            _call(f"{command.format(out=out, **logs)} --quiet")
            with Image.open(out) as picture:
                few = picture.convert("RGB").quantize(COLOURS)
            few.save(out, optimize=True)
            print(f"{out.relative_to(ROOT)}: {out.stat().st_size} bytes")


def _call(words: str) -> None:
    subprocess.run([sys.executable, "-m", "manipcli", *words.split()], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    main(sys.argv[1:])
