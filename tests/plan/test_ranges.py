from __future__ import annotations

import pytest
from pydantic import TypeAdapter, ValidationError

from manipcli.plan.ranges import Range, spread


def test_a_range_is_tried_from_its_middle() -> None:
    assert spread((0.1, 0.3)) == (0.2, 0.1, 0.3)
    assert spread((0.1, 0.1)) == (0.1,)


def test_a_range_rises() -> None:
    lengths: TypeAdapter[tuple[float, float]] = TypeAdapter(Range)
    assert lengths.validate_python(["8 cm", "20 cm"]) == (0.08, 0.2)
    assert lengths.validate_python("8 cm") == (0.08, 0.08)
    with pytest.raises(ValidationError, match="minimum 200 mm is above maximum 80 mm"):
        lengths.validate_python(["20 cm", "8 cm"])
    assert lengths.validate_python([0, 0.1]) == (0.0, 0.1)
    for below in ("-5 cm", ["-5 cm", "5 cm"]):
        with pytest.raises(ValidationError, match="must be at least 0, not -50 mm") as refused:
            lengths.validate_python(below)
        assert refused.value.errors()[0]["ctx"]["hint"] == "write [minimum, maximum], both 0 or more, or one length"
