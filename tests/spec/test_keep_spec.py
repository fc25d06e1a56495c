from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import TypeAdapter, ValidationError

from manipcli.core.errors import InvalidInput
from manipcli.spec.keep import Keeps, KeepSpec
from manipcli.task.load_task import load_task

READ: TypeAdapter[tuple[KeepSpec, ...]] = TypeAdapter(Keeps)
ROOT = Path(__file__).parents[2]


def test_a_mapping_is_a_list_of_one() -> None:
    one = {"upright": "10 deg", "tool_speed": 0.25}
    assert READ.validate_python(one) == READ.validate_python([one])
    assert len(READ.validate_python([{"above": "desk"}, {"above": "shelf", "by": "5 cm"}])) == 2


def test_what_a_log_stores_is_read_back() -> None:
    """Logs hold every field, also those that the user left out."""
    read = READ.validate_python([{"upright": "10 deg"}, {"above": "desk"}])
    assert READ.validate_python(READ.dump_python(read)) == read
    assert READ.validate_python(READ.dump_python(read, exclude_none=True)) == read


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({}, "has no constraint"),
        ({"by": 0.1}, "needs `above: BODY`"),
        ({"upright": 10}, "less than or equal"),
        ({"tool_speed": 0}, "greater than 0"),
        ({"slosh": "100 deg"}, "less than or equal"),
        ({"inside": {"box": {"centre": [0, 0, 0], "size": [1, 0, 1]}}}, "greater than 0"),
    ],
)
def test_a_value_that_means_nothing_is_refused(value: object, message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        READ.validate_python(value)


def test_an_unknown_body_is_found_in_its_place(tmp_path: Path) -> None:
    path = tmp_path / "task.yaml"
    path.write_text(
        f"""task: t
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
scene:
  desk: {{box: {{size: [0.6, 1.0, 0.4]}}, pose: {{xyz: [0.85, 0, 0.2]}}, fixed: true}}
steps:
  - move: {{to: home}}
    keep: [{{upright: 10 deg}}, {{above: dask, by: 3 cm}}]
  - wait: 1 s
    keep: {{tool_speed: 1}}
"""
    )
    with pytest.raises(InvalidInput) as refused:
        load_task(path, allow_outside=True)
    finding, still = refused.value.findings
    assert still.message.endswith("`keep` has no effect: `wait` does not move the arm")
    assert finding.place is not None
    assert (finding.place.line, finding.place.column) == (8, 39)
    assert finding.message.endswith("'dask' is not in the scene")
    assert finding.hint is not None and "desk" in finding.hint
