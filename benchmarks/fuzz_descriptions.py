"""Spoilt descriptions and meshes: no crash, no hang, nothing run, and what is accepted lives 100 steps in Bullet.

Each case follows from the seed and its number: a sound or already bad description (URDF or xacro), or a mesh with a
description of one link, in which a few things are changed. It is examined in a worker process; what has no errors is
built, written for Bullet, and stepped in another process. A worker that dies, takes too long or much memory, lets an
exception out, runs a program, opens a connection or writes a file where it should not, fails the case.

    python -m benchmarks.fuzz_descriptions --minutes 5
    python -m benchmarks.fuzz_descriptions --only 1234 --keep cases
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import resource
import select
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PATIENCE = 20.0
"""Longer than this [s] for one case is a hang."""
MEMORY = 3 * 2**30
"""[bytes] of address space for a worker."""
STEPS = 100

NUMBERS = [
    *("nan", "inf", "-inf", "1e400", "1e308", "1e-320", "0", "-0.0", "-1", "1,5", "0x10", "1_0", "", "١", "heavy"),
    *("1e6", "-1e6", "1e15", "1e-9", "99999999999999999999"),
]
NASTY = [
    *("${9**9**9}", "${'a'*4000000000}", "$(env HOME)", "$(eval open('/etc/passwd').read())", "${(lambda: 1)()}"),
    "${(lambda: load_yaml.__globals__['os'].system('touch CANARY'))()}",
    "${[c for c in ().__class__.__base__.__subclasses__()]}",
    "$(eval __import__('os').system('touch CANARY'))",
    "$(find ../../../../etc)/passwd",
    *(
        "${load_yaml('/etc/passwd')}",
        "${xacro.load_yaml('/dev/zero')}",
        "${python.open('CANARY', 'w')}",
        "$(arg x)",
        "${",
    ),
    *("/dev/zero", "../../../../../etc/passwd", "package://", "package://../x", "http://127.0.0.1/x.stl", "a\x00b"),
    *("x" * 70_000, "é\u202e", "&#0;", "<", "bad.urdf", "bad.xacro", "."),
]
ELEMENTS = [
    *(
        '<xacro:include filename="bad.xacro"/>',
        '<xacro:include filename="/dev/zero"/>',
        "<xacro:insert_block name='x'/>",
    ),
    '<xacro:macro name="m" params="x:=1"><xacro:m x="${x}"/><xacro:m/></xacro:macro><xacro:m/>',
    '<xacro:property name="p" value="${p}"/><link name="${p}"/>',
    '<joint name="j" type="revolute"><parent link="tip"/><child link="base"/></joint>',
    *("<link/>", "<link name='tip'/>", "<robot/>", "<a>" * 200 + "</a>" * 200, "<!-- x -->", "]]>", "<?x y?>"),
    '<transmission name="t"><type>SimpleTransmission</type><joint name="j"/><actuator name="m"/></transmission>',
    '<collision><geometry><mesh filename="bad.stl"/></geometry></collision>',
]
DOCTYPES = ['<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]>', '<!DOCTYPE x SYSTEM "file:///etc/passwd">']


@dataclass(frozen=True)
class Case:
    """What is written: the files by name, the first of them the description."""

    files: dict[str, bytes]

    @property
    def main(self) -> str:
        return next(iter(self.files))


@dataclass(frozen=True)
class Seeds:
    descriptions: list[tuple[str, bytes, dict[str, bytes]]]
    meshes: list[tuple[str, bytes]]


def gather() -> Seeds:
    """The bad examples of all checks, the robots of this project and of pybullet_data, a mesh of each format."""
    import pybullet_data

    from manipcli.description.lint.checks import CHECKS
    from manipcli.description.lint.samples import TETRAHEDRON, ascii_tetrahedron, collada_tetrahedron, one_joint
    from manipcli.shapes.mesh_formats import binary_stl

    descriptions: list[tuple[str, bytes, dict[str, bytes]]] = []
    for check in CHECKS:
        name = "bad.xacro" if "xmlns:xacro" in check.bad else "bad.urdf"
        files = {} if check.name == "mesh-triangles" else dict(check.files())
        descriptions.append((name, check.bad.encode(), files))
    descriptions += [("bad.urdf", one_joint().encode(), {})] * 20
    urdf = ROOT / "robots" / "arm7_hand3" / "urdf"
    own = {path.name: path.read_bytes() for path in urdf.glob("*.xacro")}
    descriptions += [(name, text, {k: v for k, v in own.items() if k != name}) for name, text in own.items()] * 4
    data = Path(pybullet_data.getDataPath())
    for path in ("kuka_iiwa/model.urdf", "franka_panda/panda.urdf", "r2d2.urdf", "cartpole.urdf", "pr2_gripper.urdf"):
        descriptions += [("bad.urdf", (data / path).read_bytes(), {})] * 4
    obj = (data / "franka_panda/meshes/collision/finger.obj").read_bytes()
    meshes = [("a.stl", binary_stl(TETRAHEDRON)), ("a.stl", ascii_tetrahedron()), ("a.dae", collada_tetrahedron())]
    return Seeds(descriptions, [*meshes, ("a.obj", obj)])


def make(number: int, seed: int, seeds: Seeds) -> Case:
    rng = random.Random(f"{seed}/{number}")
    if rng.random() < 0.3:
        name, data = rng.choice(seeds.meshes)
        for _ in range(rng.randint(0, 4)):
            data = rng.choice([spoil_bytes, spoil_bytes, spoil_numbers])(data, rng)
        text = JOINED.format(f'<mesh filename="{name}"/>', f'<mesh filename="{name}"/>')
        return Case({"bad.urdf": text.encode(), name: data})
    name, data, files = rng.choice(seeds.descriptions)
    for _ in range(rng.randint(0, 5)):
        data = rng.choice(SPOILERS)(data, rng)
    return Case({name: data[:3_000_000], **files})


JOINED = (
    '<robot name="r"><link name="base"><visual><geometry>{}</geometry></visual></link><link name="tip"><inertial>'
    '<mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry>'
    '{}</geometry></collision></link><joint name="j" type="revolute"><parent link="base"/><child link="tip"/>'
    '<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint></robot>'
)


def spoil_bytes(data: bytes, rng: random.Random) -> bytes:
    """Cut, overwrite, insert or repeat a few bytes."""
    if not data:
        return data
    at = rng.randrange(len(data))
    match rng.randrange(5):
        case 0:
            return data[:at]
        case 1:
            return data[:at] + rng.randbytes(rng.randint(1, 8)) + data[at + rng.randint(1, 8) :]
        case 2:
            return data[:at] + bytes([data[at] ^ (1 << rng.randrange(8))]) + data[at + 1 :]
        case 3:
            end = min(len(data), at + rng.randint(1, 400))
            return data[:end] + data[at:end] * rng.randint(1, 20) + data[end:]
        case _:
            return data[:at] + data[at + rng.randint(1, 60) :]


def _replaced(data: bytes, rng: random.Random, pattern: bytes, new: Callable[[], bytes]) -> bytes:
    """One occurrence of a pattern, drawn, replaced."""
    found = list(re.finditer(pattern, data))
    if not found:
        return data
    match = rng.choice(found)
    return data[: match.start(1)] + new() + data[match.end(1) :]


def spoil_numbers(data: bytes, rng: random.Random) -> bytes:
    return _replaced(data, rng, rb"(-?\d+\.?\d*(?:e-?\d+)?)", lambda: rng.choice(NUMBERS).encode())


def spoil_attribute(data: bytes, rng: random.Random) -> bytes:
    words = [*NASTY, *NUMBERS, "base", "tip", "j", "fixed", "prismatic", "1 2", "1 2 3 4"]
    return _replaced(data, rng, rb'="([^"]*)"', lambda: rng.choice(words).encode())


def spoil_name(data: bytes, rng: random.Random) -> bytes:
    names = re.findall(rb"[<\s]([a-zA-Z:_]+)[\s=>]", data) or [b"x"]
    return _replaced(data, rng, rb"[<\s/]([a-zA-Z:_]+)[\s=>/]", lambda: rng.choice(names))


def drop_element(data: bytes, rng: random.Random) -> bytes:
    return _replaced(data, rng, rb"(<[^<>]*/>)", lambda: b"")


def double_element(data: bytes, rng: random.Random) -> bytes:
    found = list(re.finditer(rb"<(link|joint|collision|inertial|geometry|origin)\b.*?(/>|</\1>)", data, re.S))
    if not found:
        return data
    match = rng.choice(found)
    return data[: match.end()] + match[0] * rng.choice([1, 1, 1, 3, 200]) + data[match.end() :]


def add_element(data: bytes, rng: random.Random) -> bytes:
    return _replaced(data, rng, rb"()</", lambda: rng.choice(ELEMENTS).encode())


def add_doctype(data: bytes, rng: random.Random) -> bytes:
    return _replaced(data, rng, rb"()<robot", lambda: rng.choice(DOCTYPES).encode()) if rng.random() < 0.2 else data


SPOILERS = [
    *(spoil_bytes, spoil_numbers, spoil_numbers, spoil_attribute, spoil_attribute, spoil_name, drop_element),
    *(double_element, add_element, add_doctype),
]


def examine_cases() -> None:
    """A worker: numbers of cases on standard input, a line about each on standard output."""
    from manipcli.core.errors import ManipcliError
    from manipcli.description.lint.examine import examine
    from manipcli.description.packages import Packages
    from manipcli.model.build_robot import build_robot
    from manipcli.model.normalised_urdf import engine_urdf
    from manipcli.spec.robot import RobotSpec

    seed, folder = int(sys.argv[2]), Path(sys.argv[3])
    seeds = gather()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    events: list[str] = []
    watched = {"on": False}

    def audit(event: str, arguments: tuple[object, ...]) -> None:
        if not watched["on"]:
            return
        running = event.startswith(("os.exec", "os.posix_spawn", "os.system", "subprocess", "socket.", "ctypes.dlopen"))
        written = event == "open" and isinstance(arguments[1], str) and set(arguments[1]) & set("wax+")
        if running or (written and not str(arguments[0]).startswith(str(folder))):
            events.append(f"{event} {arguments[0]!r:.100}")

    sys.addaudithook(audit)
    for line in sys.stdin:
        number = int(line)
        place = folder / str(number)
        place.mkdir()
        case = make(number, seed, seeds)
        for name, data in case.files.items():
            (place / name).write_bytes(data)
        events.clear()
        os.chdir(place)
        result: dict[str, object] = {"number": number, "fault": "", "accepted": False}
        start = time.perf_counter()
        try:
            watched["on"] = True
            path = place / case.main
            found = examine(path, packages=Packages(path))
            messages = [finding.message for finding in found.findings]
            unmade = [message for message in messages if "failed with an internal error" in message]
            if unmade:
                result["fault"] = unmade[0]
            elif not found.errors:
                robot, _ = build_robot(RobotSpec(robot="r", description=path.name), file=place / "robot.yaml")
                (place / "out").mkdir()
                try:
                    (place / "out" / "robot.urdf").write_text(engine_urdf(robot, place / "out"), encoding="utf-8")
                    result["accepted"] = len(robot.joints) <= 127
                except ManipcliError:
                    pass  # told again, at the last door: a joint that moves no mass
        except ManipcliError as error:
            result["fault"] = f"accepted by examine, refused by build_robot: {error}"
        except BaseException:  # noqa: BLE001 (that none gets out is what is asked here)
            result["fault"] = traceback.format_exc(limit=-4)
        finally:
            watched["on"] = False
        result["seconds"] = time.perf_counter() - start
        if events or list(place.glob("CANARY*")):
            result["fault"] = f"something was run or written: {events}"
        os.chdir(folder)
        if not result["accepted"] and not result["fault"]:
            shutil.rmtree(place)
        sys.stdout.write(json.dumps(result) + "\n")
        sys.stdout.flush()


def step_robots() -> None:
    """A worker: numbers of accepted cases on standard input, a line about each on standard output."""
    import math

    import pybullet as p

    folder = Path(sys.argv[3])
    reply = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # Bullet's C code writes there
    p.connect(p.DIRECT)
    for line in sys.stdin:
        number = int(line)
        p.resetSimulation()
        p.setTimeStep(1e-3)
        p.setGravity(0, 0, -9.8)
        fault = ""
        start = time.perf_counter()
        try:
            flags = p.URDF_USE_INERTIA_FROM_FILE | p.URDF_IGNORE_VISUAL_SHAPES
            robot = p.loadURDF(str(folder / str(number) / "out" / "robot.urdf"), useFixedBase=True, flags=flags)
            for _ in range(STEPS):
                p.stepSimulation()
            states = [p.getJointState(robot, k)[:2] for k in range(p.getNumJoints(robot))]
            if not all(math.isfinite(value) for state in states for value in state):
                fault = "states that are not finite"
        except p.error as error:
            fault = f"Bullet refuses it: {error}"
        shutil.rmtree(folder / str(number)) if not fault else None
        seconds = time.perf_counter() - start
        reply.write(json.dumps({"number": number, "fault": fault, "seconds": seconds}) + "\n")
        reply.flush()


class Worker:
    """A process that answers numbers with lines; started again after it died or was ended."""

    def __init__(self, role: str, seed: int, folder: Path) -> None:
        self._command = [sys.executable, str(Path(__file__).resolve()), role, str(seed), str(folder)]
        self._process: subprocess.Popen[str] | None = None
        self._done = 0

    def ask(self, number: int) -> dict[str, object]:
        if self._process is None:
            environment = {**os.environ, "PYTHONPATH": str(ROOT)}
            self._process = subprocess.Popen(
                self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
            )
            self._done = 0
        process = self._process
        assert process.stdin is not None and process.stdout is not None
        process.stdin.write(f"{number}\n")
        process.stdin.flush()
        ready, _, _ = select.select([process.stdout], [], [], PATIENCE + (20.0 if self._done == 0 else 0.0))
        line = process.stdout.readline() if ready else ""
        self._done += 1
        if line:
            return dict(json.loads(line))
        process.kill()
        code = process.wait()
        self._process = None
        return {"number": number, "fault": f"ended by signal {-code}" if ready else f"took more than {PATIENCE:.0f} s"}

    def close(self) -> None:
        if self._process is not None and self._process.stdin is not None:
            self._process.stdin.close()
            self._process.wait(timeout=10)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=2.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="one case again")
    parser.add_argument("--keep", type=Path, help="where the files of failed cases are kept")
    options = parser.parse_args()
    counts: Counter[str] = Counter()
    slowest = (0.0, 0)
    with tempfile.TemporaryDirectory(prefix="manipcli-fuzz-") as name:
        folder = Path(name)
        readers, stepper = Worker("--examine", options.seed, folder), Worker("--step", options.seed, folder)
        end = time.monotonic() + 60.0 * options.minutes
        number = options.only if options.only is not None else 0
        while time.monotonic() < end:
            answer = readers.ask(number)
            counts["cases"] += 1
            slowest = max(slowest, (float(str(answer.get("seconds", 0.0))), number))
            if answer.get("accepted") and not answer["fault"]:
                counts["accepted and stepped"] += 1
                answer = stepper.ask(number)
            if answer["fault"]:
                counts["failed"] += 1
                print(f"case {number}: {answer['fault']}")
                if options.keep is not None and (folder / str(number)).is_dir():
                    shutil.copytree(folder / str(number), options.keep / str(number), dirs_exist_ok=True)
            if options.only is not None:
                break
            number += 1
        readers.close()
        stepper.close()
    print(", ".join(f"{count} {what}" for what, count in counts.items()), end="; ")
    print(f"slowest: case {slowest[1]}, {slowest[0]:.2f} s; seed {options.seed}")
    return 1 if counts["failed"] else 0


if __name__ == "__main__":
    roles = {"--examine": examine_cases, "--step": step_robots}
    role = roles.get(sys.argv[1]) if len(sys.argv) > 1 else None
    if role is None:
        sys.exit(main())
    sys.path.insert(0, str(ROOT))
    role()
