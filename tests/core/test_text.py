"""Text for people: near names are found, far ones are not, and nothing reaches a terminal as a control."""

from __future__ import annotations

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from manipcli.core.text import (
    any_of,
    did_you_mean,
    digits,
    distinguished,
    escape,
    listed,
    nearest,
    nearest_file,
    number_of,
    shorten,
    shorten_apart,
)

JOINTS = [f"joint_{k}" for k in range(1, 8)]


def test_the_nearest_names_come_first() -> None:
    assert nearest("jiont_3", JOINTS)[0] == "joint_3"
    assert len(nearest("joint_9", JOINTS, most=3)) == 3
    assert nearest("Home", ["ready", "home"]) == ("home",)
    assert nearest("table", ["home", "ready"]) == ()
    assert nearest("vel", ["position", "velocity"]) == ("velocity",)


def test_a_hint_names_the_nearest_or_else_what_there_is() -> None:
    assert did_you_mean("hoem", ["ready", "home"]) == "did you mean 'home'?"
    assert did_you_mean("xyz", ["ready", "home"], kind="poses") == "poses: ready, home"
    assert did_you_mean("xyz", []) is None


def test_lists_of_names() -> None:
    assert any_of(["a", "b", "c"]) == "'a', 'b' or 'c'"
    assert listed(map(str, range(5)), most=3) == "0, 1, 2, and 2 more"


def test_an_escape_sequence_stays_visible() -> None:
    assert escape("\x1b[2Jred\n\u202e") == "\\x1b[2Jred\\n\\u202e"

    assert escape("a\u200bb\U000e0041") == "a\\u200bb\\U000e0041"


@given(st.text())
def test_escaped_text_has_no_control_characters(text: str) -> None:
    assert not any(unicodedata.category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp") for c in escape(text))


@given(st.text(), st.integers(4, 80))
def test_shortened_text_fits(text: str, width: int) -> None:
    assert len(shorten(text, width=width)) <= width


@given(st.text(), st.text(), st.text(), st.integers(12, 80))
def test_shortened_texts_that_differ_look_different(before: str, one: str, other: str, width: int) -> None:
    told = shorten_apart(before + one, before + other, width=width)
    assert (told[0] == told[1]) == (escape(before + one) == escape(before + other))
    assert max(map(len, told)) <= width


def test_a_difference_far_behind_is_shown_with_what_is_before_it() -> None:
    said = "joint 'joint_1' is outside its goal tolerance: error +0.2"
    assert shorten_apart(f"{said}22133 rad", f"{said}31 rad") == (
        "...olerance: error +0.222133 rad",
        "...olerance: error +0.231 rad",
    )
    assert shorten_apart("passed", "failed") == ("passed", "failed")


@given(st.text(), st.lists(st.text(), max_size=5))
def test_near_names_are_known_names(name: str, known: list[str]) -> None:
    assert set(nearest(name, known, most=2)) <= set(known)


@pytest.mark.parametrize(
    ("number", "noun", "told"),
    [(1, "file", "1 file"), (0, "file", "0 files"), (1, "process", "1 process"), (2, "process", "2 processes")],
)
def test_a_number_of_things_is_told_as_one_says_it(number: int, noun: str, told: str) -> None:
    assert number_of(number, noun) == told


@pytest.mark.parametrize(
    ("value", "told"),
    [(6000.0, "6000"), (164.3, "164"), (60512.0, "60500"), (0.08434, "0.0843"), (2e5, "2e+05"), (0.0, "0")],
)
def test_three_digits_stand_without_an_exponent_while_people_would_write_none(value: float, told: str) -> None:
    assert digits(value) == told


@pytest.mark.parametrize(
    ("one", "other", "form", "told"),
    [
        (2.09441, 2.0943951, ".4f", ("2.09441", "2.09440")),
        (1.0, 2.0, ".4f", ("1.0000", "2.0000")),
        (100.0001, 100.0, ".3g", ("100.0001", "100")),
        (1.0 + 2.0**-52, 1.0, ".4g", ("1.0000000000000002", "1")),
        (5.0, 5.0, ".3g", ("5", "5")),
        (float("inf"), 1.0, ".4g", ("inf", "1")),
    ],
)
def test_numbers_that_differ_look_different(one: float, other: float, form: str, told: tuple[str, str]) -> None:
    assert distinguished(one, other, form=form) == told


@pytest.mark.parametrize(
    ("name", "known", "meant"),
    [
        ("none.yaml", ["w1.yaml", "w3.yaml"], ()),
        ("robt.yaml", ["robot.yaml", "tasks.yaml", "robot.urdf"], ("robot.yaml",)),
        ("robot.yaml", ["robot.yml", "other.yaml"], ("robot.yml",)),
        ("arm.stl", ["Arm.STL", "base.stl"], ("Arm.STL",)),
        ("folder", ["folders", "a.yaml"], ("folders",)),
        ("x.yaml", [], ()),
    ],
)
def test_an_ending_in_common_makes_no_file_look_like_another(
    name: str, known: list[str], meant: tuple[str, ...]
) -> None:
    assert nearest_file(name, known) == meant
