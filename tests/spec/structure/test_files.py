"""Sub-tasks and fragments: their values, their places with the places of use, and files that a task must not read."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from manipcli.core.errors import Diagnostic, InvalidInput
from manipcli.spec.load import load_task, load_task_text
from manipcli.spec.located import Located
from manipcli.spec.resolved import resolved
from manipcli.spec.retry import expressions, retried
from manipcli.spec.task import TaskSpec
from manipcli.task.vocabulary import task_spec

HEAD = "task: t\nrobot: r.yaml\ncontrollers: c.yaml\n"
BODY = "{box: {size: [1 cm, 1 cm, 1 cm]}, mass: 1, pose: {}}"
SCENE = f"scene: {{a: {BODY}, b: {BODY}}}\n"
STACK = """params:
  object: {type: body}
  height: {type: length, default: 5 cm}
steps:
  - pick: {object: $object}
  - lift: {object: $object, by: 2 * $height}
    on_fail: {retry: 1, with: {height: 9 cm}}
"""


def loaded(folder: Path, text: str, **files: str) -> Located[TaskSpec]:
    for name, content in {"t": HEAD + text, **files}.items():
        (folder / f"{name}.yaml").write_text(content)
    return load_task(folder / "t.yaml", model=task_spec())


def refused(folder: Path, text: str, **files: str) -> tuple[Diagnostic, ...]:
    with pytest.raises(InvalidInput) as error:
        loaded(folder, text, **files)
    return error.value.findings


def test_a_sub_task_gets_its_values_and_its_places(tmp_path: Path) -> None:
    first = "  - do: s.yaml\n    with: {object: a, height: 3 * $h}\n"
    text = f"{SCENE}params: {{h: 2 cm}}\nsteps:\n{first}  - do: s.yaml\n    with: {{object: b}}\n"
    task = loaded(tmp_path, text, s=STACK)
    assert [step.id for step in task.spec.steps] == ["s_1/pick_1", "s_1/lift_1", "s_2/pick_1", "s_2/lift_1"]
    assert [task.spec.steps[k].body.by[0] for k in (1, 3)] == pytest.approx([0.12, 0.1])  # type: ignore[attr-defined]
    place = task.place("steps", 3)
    assert (place.file, place.line) == (str(tmp_path / "s.yaml"), 6)
    assert place.expanded == f"used at {tmp_path / 't.yaml'}:9:9"
    assert [(block.word, block.kind) for block in task.spec.blocks] == [("do", "sequence")] * 2


def test_a_log_holds_what_a_retry_in_a_sub_task_needs(tmp_path: Path) -> None:
    task = loaded(tmp_path, f"{SCENE}steps: [{{do: s.yaml, with: {{object: a}}}}]\n", s=STACK)
    log = load_task_text(resolved(task.spec, expressions(task)), "log", model=task_spec())
    assert log.spec == task.spec
    assert resolved(log.spec, expressions(log)) == resolved(task.spec, expressions(task))
    assert "params: {height: 5 cm, object: a}" in resolved(task.spec, expressions(task)).replace('"', "")
    assert retried(log, 1) == retried(task, 1)
    assert retried(log, 1).body.by[0] == pytest.approx(0.18)  # type: ignore[attr-defined]


def test_fragments_bring_bodies_frames_and_steps(tmp_path: Path) -> None:
    (tmp_path / "cells").mkdir()
    mesh = "{mesh: {file: meshes/m.stl}, pose: {}, fixed: true}"
    (tmp_path / "cells" / "cell.yaml").write_text(
        f"scene: {{desk: {BODY}, m: {mesh}}}\nframes: {{slot: {{parent: desk}}}}\nsteps: [{{wait: $pause}}]\n"
    )
    cell = "include: cells/cell.yaml"
    blocks = f"scene: {{{cell}, a: {BODY}}}\nframes: {{{cell}}}\n"
    task = loaded(tmp_path, f"params: {{pause: 2 s}}\n{blocks}steps: [{{wait: 0}}, {{{cell}}}, {{wait: 1}}]\n")
    assert list(task.spec.scene) == ["desk", "m", "a"] and list(task.spec.frames) == ["slot"]
    assert [step.id for step in task.spec.steps] == ["wait_1", "wait_2", "wait_3"]
    assert task.spec.steps[1].body.duration == 2.0  # type: ignore[attr-defined]
    shape = task.spec.scene["m"].mesh
    assert shape is not None and Path(shape.file) == Path("cells/meshes/m.stl")


def test_an_override_takes_another_cell(tmp_path: Path) -> None:
    for name, body in (("one", "x"), ("two", "y")):
        (tmp_path / f"{name}.yaml").write_text(f"scene: {{{body}: {BODY}}}\n")
    (tmp_path / "t.yaml").write_text(f"{HEAD}scene: {{include: one.yaml}}\nsteps: [{{wait: 0}}]\n")
    overrides = ["scene.include=two.yaml", "scene.y.mass=3"]
    task = load_task(tmp_path / "t.yaml", model=task_spec(), overrides=overrides)
    assert {name: body.mass for name, body in task.spec.scene.items()} == {"y": 3.0}


def test_an_error_in_a_sub_task_names_every_use_around_it_once(tmp_path: Path) -> None:
    outer = "steps:\n  - repeat: {times: 3, steps: [{do: inner.yaml}]}\n"
    (found,) = refused(tmp_path, "steps: [{do: outer.yaml}]\n", outer=outer, inner="steps: [{wait: 5 kg}]\n")
    assert (found.code, str(found.place)) == ("TASK207", f"{tmp_path / 'inner.yaml'}:1:16")
    assert found.message.startswith("steps[0].wait: ")
    uses = f"used at {tmp_path / 't.yaml'}:4:14, then at {tmp_path / 'outer.yaml'}:2:37"
    assert uses in (found.hint or "")


FAULTY: tuple[tuple[str, str, str, str, str], ...] = (
    ("TASK268", "t.yaml:5:37", "there is no body 'c'", "[{do: s.yaml, with: {object: c}}]", STACK),
    ("TASK268", "t.yaml:5:48", "is a mass", "[{do: s.yaml, with: {object: a, height: 5 kg}}]", STACK),
    ("TASK267", "t.yaml:5:14", "no value for `object` (body)", "[{do: s.yaml}]", STACK),
    ("TASK267", "t.yaml:5:40", "did you mean 'height'", "[{do: s.yaml, with: {object: a, heigth: 5 cm}}]", STACK),
    ("TASK267", "t.yaml:5:28", "expected names with values", "[{do: s.yaml, with: [a]}]", STACK),
    ("TASK264", "t.yaml:5:14", "there is no file 'S.yml'", "[{do: S.yml}]", STACK),
    ("TASK264", "t.yaml:5:14", "outside the folder", "[{do: ../../etc/passwd}]", STACK),
    ("TASK264", "t.yaml:5:14", "has no parameters", "[{do: $which}]", STACK),
    ("TASK264", "t.yaml:5:14", "expected the name of a file", "[{do: {file: s.yaml}}]", STACK),
    ("TASK264", "s.yaml:1:14", "uses itself", "[{do: s.yaml}]", "steps: [{do: s.yaml}]\n"),
    ("TASK265", "s.yaml:1:1", "this is a task", "[{do: s.yaml}]", "task: x\nsteps: [{wait: 0}]\n"),
    ("TASK265", "s.yaml:1:1", "use the file with `do:`", "[{include: s.yaml}]", STACK),
    ("TASK265", "s.yaml:1:1", "did you mean 'steps'", "[{do: s.yaml}]", "stesp: [{wait: 0}]\n"),
    ("TASK265", "s.yaml:1:1", "the sub-task has no `steps`", "[{do: s.yaml}]", "description: x\n"),
    (
        "TASK266",
        "s.yaml:1:13",
        "write `{type: length}`",
        "[{do: s.yaml}]",
        "params: {x: length}\nsteps: [{wait: $x}]\n",
    ),
    (
        "TASK266",
        "s.yaml:1:20",
        "did you mean 'time'",
        "[{do: s.yaml}]",
        "params: {x: {type: tmie}}\nsteps: [{wait: $x}]\n",
    ),
    ("TASK203", "s.yaml:1:16", "knows only its own `params`", "[{do: s.yaml}]", "steps: [{wait: $pause}]\n"),
    ("YAML100", "s.yaml:2:1", "used at", "[{do: s.yaml}]", "steps: [\n"),
    ("TASK262", "s.yaml:1:8", "expected a list of steps", "[{do: s.yaml}]", "steps: {wait: 0}\n"),
)


@pytest.mark.parametrize(("code", "place", "words", "steps", "file"), FAULTY)
def test_a_fault_in_or_around_a_file(tmp_path: Path, code: str, place: str, words: str, steps: str, file: str) -> None:
    (found,) = refused(tmp_path, f"{SCENE}steps: {steps}\n", s=file)
    assert found.place is not None
    assert (found.code, f"{Path(found.place.file).name}:{found.place.line}:{found.place.column}") == (code, place)
    assert words in f"{found.message} {found.hint}"


def test_a_body_in_two_files_is_told_with_both_places(tmp_path: Path) -> None:
    text = f"scene: {{include: cell.yaml, a: {BODY}}}\nsteps: [{{wait: 0}}]\n"
    (found,) = refused(tmp_path, text, cell=f"scene: {{a: {BODY}}}\n")
    assert found.code == "TASK273" and f"{tmp_path / 'cell.yaml'}:1:9 has it already" in found.message


def test_a_misspelt_value_is_not_missing_too(tmp_path: Path) -> None:
    (found,) = refused(tmp_path, f"{SCENE}steps: [{{do: s.yaml, with: {{objct: a}}}}]\n", s=STACK)
    assert found.hint == "did you mean 'object'?"


def test_a_fragment_is_included_where_it_has_a_block(tmp_path: Path) -> None:
    (found,) = refused(tmp_path, "steps: [{include: s.yaml}]\n", s=f"scene: {{a: {BODY}}}\n")
    assert found.hint is not None and "include it in `scene`" in found.hint
    (found,) = refused(tmp_path, "scene: {include: s.yaml}\nsteps: [{wait: 0}]\n", s=f"shelf: {BODY}\n")
    assert found.hint is not None and "put bodies below `scene:`" in found.hint
    (found,) = refused(tmp_path, "include: s.yaml\nsteps: [{wait: 0}]\n")
    assert found.hint == "put `include: FILE` inside `scene`, `frames` or `steps`"


def test_a_sub_task_of_a_fragment_is_relative_to_it_and_names_both_uses(tmp_path: Path) -> None:
    (tmp_path / "cells").mkdir()
    (tmp_path / "cells" / "f.yaml").write_text("steps: [{repeat: {times: 2, steps: [{do: s.yaml}]}}]\n")
    (tmp_path / "cells" / "s.yaml").write_text("steps: [{wiat: 0}]\n")
    (found,) = refused(tmp_path, "steps: [{include: cells/f.yaml}]\n")
    inner = tmp_path / "cells" / "f.yaml"
    assert found.place is not None and found.place.file == str(tmp_path / "cells" / "s.yaml")
    assert found.place.expanded == f"used at {tmp_path / 't.yaml'}:4:19, then at {inner}:1:42"
    (tmp_path / "cells" / "s.yaml").write_text("steps: [{include: f.yaml}]\n")
    first, *_ = refused(tmp_path, "steps: [{include: cells/f.yaml}]\n")
    assert "uses itself" in first.message


def test_an_unused_parameter_is_a_warning(tmp_path: Path) -> None:
    task = loaded(tmp_path, "steps: [{do: s.yaml}]\n", s="params: {x: {type: time, default: 1}}\nsteps: [{wait: 0}]\n")
    assert [(finding.code, finding.severity) for finding in task.findings] == [("TASK272", "warning")]


@pytest.mark.parametrize("kind", ["link", "pipe", "large"])
def test_files_that_are_not_read(tmp_path: Path, kind: str) -> None:
    outside, inside = tmp_path / "x.yaml", tmp_path / "in"
    inside.mkdir()
    outside.write_text("steps: [{wait: 0}]\n")
    if kind == "link":
        (inside / "s.yaml").symlink_to(outside)
    elif kind == "pipe":
        os.mkfifo(inside / "s.yaml")
    else:
        (inside / "s.yaml").write_bytes(b"#" * 10_000_001)
    (found,) = refused(inside, "steps: [{do: s.yaml}]\n")
    assert found.code == {"link": "TASK264", "pipe": "USE102", "large": "YAML103"}[kind]
    assert found.place is not None and found.place.line == 4


def nest(inner: str, pattern: str, times: int) -> str:
    for _ in range(times):
        inner = pattern % inner
    return f"steps: [{inner}]\n"


HOSTILE = (
    nest("{wait: 0}", "{repeat: {times: 2000, steps: [%s]}}", 12),
    nest("{if: false, then: [{wait: 0}]}", "{repeat: {times: 2000, steps: [%s]}}", 12),
    nest("{wait: 0}", "{sequence: [%s]}", 25),
    "params: {x: 1}\n" + nest("{wait: $x}", "{repeat: {each: {x: [[$x, $x]]}, steps: [%s]}}", 19),
)


@pytest.mark.parametrize("text", HOSTILE)
def test_structure_that_grows_without_bound_is_refused(tmp_path: Path, text: str) -> None:
    assert "TASK269" in {finding.code for finding in refused(tmp_path, text)}


@pytest.mark.parametrize("word", ["do", "include"])
def test_files_that_use_each_other_without_bound_are_refused(tmp_path: Path, word: str) -> None:
    files = {f"f{k}": "steps:\n" + f"  - {word}: f{k + 1}.yaml\n" * 40 for k in range(8)}
    found = refused(tmp_path, f"steps: [{{{word}: f0.yaml}}]\n", **files, f8="steps: [{wait: 0}]\n")
    assert "TASK269" in {finding.code for finding in found}
