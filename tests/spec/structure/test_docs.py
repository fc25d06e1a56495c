"""The examples of docs/reference/structure.md load, and the page names every word and type."""

from __future__ import annotations

import re
from pathlib import Path

from manipcli.spec.load import load_task
from manipcli.spec.structure.params import TYPES
from manipcli.spec.structure.words import WORDS
from manipcli.task.vocabulary import task_spec

PAGE = (Path(__file__).parents[3] / "docs" / "reference" / "structure.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
HEAD = "task: t\nrobot: r\ncontrollers: c\n"
BODY = "{box: {size: [1 cm, 1 cm, 1 cm]}, mass: 1, pose: {}}"
BODIES = "".join(f"  {name}: {BODY}\n" for name in ("red_1", "red_2", "blue_1", "red_tray", "blue_tray", "cup"))


def test_the_examples_load(tmp_path: Path) -> None:
    for example in EXAMPLES:
        named = re.match(r"# (\w+/\w+\.yaml)\n", example)
        if named is not None:
            file = tmp_path / named[1].removeprefix("tasks/")
            file.parent.mkdir(exist_ok=True)
            file.write_text(example)
    for example in EXAMPLES:
        if "steps:" in example and "params:" not in example:
            scene = "" if "scene:" in example else f"scene:\n{BODIES}"
            (tmp_path / "task.yaml").write_text(f"{HEAD}{scene}{example}")
            task = load_task(tmp_path / "task.yaml", model=task_spec())
            if "sort" in example:
                assert [step.id for step in task.spec.steps][6] == "sort[2]/if_1/put_1/pick_1"


def test_every_word_and_type_is_there() -> None:
    assert [word for word in (*WORDS, *TYPES) if f"`{word}" not in PAGE] == []
