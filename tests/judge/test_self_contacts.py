"""Contacts of the robot with itself: the pair, when it began, its largest force; in the text and JSON of a verdict."""

from __future__ import annotations

import json
from dataclasses import replace

from manipcli.judge.self_contacts import SelfContact, SelfContacts, self_contact_line
from manipcli.judge.verdict import Verdict
from manipcli.model.state import Contact
from manipcli.record.recording import ContactSnapshot
from manipcli.report.json import render_run
from manipcli.report.run_report import RunReport, Timing
from manipcli.report.text import render_verdict

PASSED = Verdict("t", "passed", 0, "pybullet", 1.0, (), ())


def snapshot(time: float, *contacts: tuple[str, str, float]) -> ContactSnapshot:
    return ContactSnapshot(time, tuple(Contact(a, b, force, 0.0) for a, b, force in contacts))


def test_pairs_of_links_are_found_with_their_first_time_and_largest_force() -> None:
    seen = SelfContacts()
    seen.add([snapshot(0.1, ("cup", "robot/palm", 30.0), ("robot/a", "robot/b", 0.0), ("cup", "desk", 9.0))])
    assert seen.found() == ()
    seen.add([snapshot(0.2, ("robot/c", "robot/d", 1.0)), snapshot(0.3, ("robot/a", "robot/b", 2.0))])
    seen.add([snapshot(0.4, ("robot/a", "robot/b", 7.0)), snapshot(0.5, ("robot/a", "robot/b", 3.0))])
    assert seen.found() == (SelfContact("c", "d", 0.2, 1.0, 0.2), SelfContact("a", "b", 0.3, 7.0, 0.4))


def test_a_verdict_names_the_hardest_three_pairs_and_still_passes() -> None:
    found = tuple(
        SelfContact("a", name, 0.5, force, 0.7) for name, force in zip("bcde", (1.0, 4.0, 3.0, 2.0), strict=True)
    )
    line = self_contact_line(found)
    assert line.startswith("the robot touches itself: 'a' and 'c' from 0.500 s, up to 4 N at 0.700 s; 'a' and 'd' from")
    assert line.endswith("; 1 pair more with less force")
    touching = replace(PASSED, self_contacts=found)
    assert f"\nwarning: {line}\n" in render_verdict(touching, "x.mcap")
    assert "warning" not in render_verdict(PASSED, "x.mcap")
    made = json.loads(render_run(RunReport(touching, Timing())))
    assert made["verdict"] == "passed"
    assert made["self_contacts"][1] == {"a": "a", "b": "c", "time": 0.5, "force": 4.0, "at": 0.7}
