"""Quantities in sentences: the shortest unit, which reads back to the same value."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from manipcli.core.prose import amount, between, listing, named, point, sentence
from manipcli.core.units import parse_quantity


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("8 cm", amount(0.08, "m")),
        ("36 mm", amount(0.036, "m")),
        ("1.5 m", amount(1.5, "m")),
        ("0 m", amount(-0.0, "m").replace("cm", "m")),
        ("125 deg", amount(math.radians(125), "rad")),
        ("150 g", amount(0.15, "kg")),
        ("2 kg", amount(2.0, "kg")),
        ("0.5 s", amount(0.5, "s")),
        ("50 ms", amount(0.05, "s")),
        ("8 N", amount(8.0, "N")),
        ("8 to 20 cm", between((0.08, 0.2), "m")),
        ("10 cm", between((0.1, 0.1), "m")),
        ("[0.5, -0.2, 0.225] m", point((0.5, -0.2, 0.225))),
        ("[0, 0, 12] cm", point((0.0, 0.0, 0.12))),
        ("[180, 0, 0] deg", point((math.pi, 0.0, 0.0), "rad")),
        ("a, b and c", listing(["a", "b", "c"])),
        ("a or b", listing(["a", "b"], "or")),
        ("link 'hand'", named("robot/hand")),
        ("'Cup' is there.", sentence("'Cup' is there")),
        ("Lift it.", sentence("lift it")),
    ],
)
def test_known_texts(text: str, found: str) -> None:
    assert found == text


@given(
    st.floats(1e-7, 1e7) | st.floats(-1e7, -1e-7),
    st.sampled_from(["m", "rad", "kg", "s", "N", "m/s", "rad/s", "J", "N m"]),
)
def test_an_amount_reads_back(value: float, symbol: str) -> None:
    found = parse_quantity(amount(value, symbol))
    assert found.dimension == parse_quantity(f"1 {symbol}").dimension
    # Four significant digits.
    assert found.value == pytest.approx(value, rel=5.1e-4)
