"""The page about a run: from the log alone, harmless whatever things are called, and it says what it lacks."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from manipcli.core.errors import Diagnostic, Place
from manipcli.core.geometry import frozen
from manipcli.judge.drawn import Drawn
from manipcli.judge.measures.facts import JointFacts, Peak, RunFacts, StepFacts, Use
from manipcli.judge.measures.grasp_intervals import GraspFacts, Hold, Slip, Spread
from manipcli.judge.saturations import Saturations
from manipcli.judge.verdict import Attempt, ExpectationOutcome, StepOutcome, Verdict
from manipcli.pipeline import load_task
from manipcli.replay.cause import Cause, Written
from manipcli.report.html.markup import Markup, element, joined
from manipcli.report.html.page_parts import number, of_limit, signed
from manipcli.report.html.render_page import render_page
from manipcli.report.run_page import Picture, RunPage, Source

ROOT = Path(__file__).parents[3]
RunCli = Callable[..., Any]
HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)> & 'x' \"y\" \x1b[31m {{7*7}}"
VOID = {"br", "img", "input", "line", "link", "meta", "rect", "polygon"}


class _Page(HTMLParser):
    """Elements in the order in which they open; every one must be closed by its own end."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []
        self._open: list[str] = []
        self.feed(page)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self._open and self._open[-1] not in ("script", "style"):
            self.text.append(data)

    @property
    def words(self) -> str:
        return " ".join(" ".join(self.text).split())

    def ids(self) -> list[str]:
        return [attributes["id"] or "" for _, attributes in self.found if "id" in attributes]


def _facts(name: str = "joint_1") -> RunFacts:
    use = Use(0.97, -2.03, -2.09, 0.6)
    joint = JointFacts(
        name, "rad", Peak(0.01, 1.2), 0.004, use, None, Use(1.1, 44.0, 40.0, 1.0), 7.66, 1.0, Peak(15, 0.9), 7
    )
    step = StepFacts("a", 0.0, frozen([7.66]), frozen([1.0]), frozen([15.0]), Peak(15.0, 0.9))
    hold = GraspFacts(
        Hold("cup", 1.0, 1.1, 2.0, "lost"), Spread(4.0, 5.5, 6.0), Spread(1, 1.7, 2), ("thumb", name),
        Slip(0.0042, 1.5, 0.001), Slip(0.1, 2.0, 0.1),
    )  # fmt: skip
    return RunFacts(
        (joint,), (step,), (hold,), (("motor", 3),), frozen([0.5, 1.5]), frozen([[0.01], [0.002]]), 0.001, 0, 2
    )


def _page(name: str = "a name") -> RunPage:
    """A failed run with one of everything but a replay."""
    verdict = Verdict(
        name, "failed", 1, "pybullet", 2.0,
        (StepOutcome("a", name, "done", 0.0, 1.2, 1.0, name), StepOutcome(name, "wait", "failed", 1.2, None, 1.0, name),
         StepOutcome("c", "wait", "not_run", None, None, 1.0)),
        (ExpectationOutcome(name, "failed", -0.016, "m", 1.5, name),
         ExpectationOutcome("upright", "passed", 0.05, "rad", 2.0),
         ExpectationOutcome("in", "not_evaluated", None, "m", None)),
        (), name,
    )  # fmt: skip
    places = tuple(Written(f"{name}:{13 + k}", "task.yaml", k + 1) for k in range(3))
    picture = Picture(1.2, b"RIFF", (4, 3))
    return RunPage(
        verdict=verdict, log=name, lost=name, causes=(Cause(name, name, 1.5, places[1], name), Cause("also", "", None)),
        steps=places, expectations=(Written(""), places[0], places[1]), limits=(0.02, 0.0873, None), facts=_facts(name),
        pictures={"a": picture}, moment=picture, sources=(Source("task.yaml", f"steps:\n  - {name}\n\n  - b"),),
        provenance=((name, name),), hashes=((name, "0" * 64),), notes=(name,),
    )  # fmt: skip


def test_names_are_text_and_nothing_else() -> None:
    calm, hostile = _Page(render_page(_page())), _Page(render_page(_page(HOSTILE)))
    assert [tag for tag, _ in hostile.found] == [tag for tag, _ in calm.found]
    assert [sorted(attributes) for _, attributes in hostile.found] == [sorted(a) for _, a in calm.found]
    assert "alert(1)" in hostile.words and "\x1b" not in hostile.words


def test_markup_escapes_what_is_not_markup() -> None:
    assert element("p", "<b>", class_='"') == '<p class="&quot;">&lt;b&gt;</p>'
    assert joined(Markup("<b>"), "<b>", None) == "<b>&lt;b&gt;"
    assert element("rect", x=1.25, hidden=True, gone=None) == '<rect x="1.25" hidden />'


def test_the_page_asks_for_nothing() -> None:
    page = render_page(_page())
    for tag, attributes in _Page(page).found:
        for name in ("src", "href", "data", "action", "poster", "srcset"):
            value = attributes.get(name) or ""
            assert value == "" or value.startswith(("data:", "#")), (tag, name, value)
    assert not re.search(r"https?://|@import|url\(|fetch\(|XMLHttpRequest|WebSocket", page)
    assert any("default-src 'none'" in (attributes.get("content") or "") for _, attributes in _Page(page).found)
    assert render_page(_page()) == page  # the same bytes every time


def test_every_link_leads_somewhere() -> None:
    page = _Page(render_page(_page()))
    ids = page.ids()
    assert len(ids) == len(set(ids))
    targets = [str(a["href"])[1:] for tag, a in page.found if tag == "a"]
    assert targets and set(targets) <= set(ids)


def test_the_cause_comes_first_and_the_verdict_before_it() -> None:
    page = replace(_page(), causes=(Cause("step 'b' failed", "it slipped by 82 mm", 1.5),))
    words = _Page(render_page(page)).words
    order = ["✗ failed", "✗ step 'b' failed", "it slipped by 82 mm", "show 1.50 s", "−16.0 mm"]
    found = [words.index(each) for each in order[:3]] if page.playback is None else []
    assert found == sorted(found)
    assert words.index("82 mm") < words.index("−16.0 mm") < words.index("Tracking and limits")


def test_many_causes_are_folded_where_the_page_tells_them_again() -> None:
    causes = tuple(Cause(f"expectation 'e{k}' fails", "") for k in range(12))
    folds = [
        [attributes for tag, attributes in _Page(render_page(page)).found if tag == "details"]
        for page in (replace(_page(), causes=causes[:5]), replace(_page(), causes=causes))
    ]
    assert len(folds[1]) == len(folds[0]) + 1
    assert " 8 more " in _Page(render_page(replace(_page(), causes=causes))).words
    assert " more " not in _Page(render_page(replace(_page(), causes=causes, facts=None))).words


def test_what_was_doubted_before_the_run_is_told() -> None:
    doubt = Diagnostic("CTRL150", "the gains of 'j' are weak", Place("a/c.yaml", 3, 5), "raise p", "warning")
    told = _Page(render_page(replace(_page(), warnings=(doubt,))))
    assert "the gains of 'j' are weak a/c.yaml:3:5" in told.words
    assert "hint: raise p" in told.words
    assert "warnings" in told.ids()
    assert "warnings" not in _Page(render_page(_page())).ids()


def test_what_was_cut_at_its_limits_stands_with_the_causes() -> None:
    page = replace(_page(), causes=(Cause("expectation 'near' fails by 2 mm", "", 1.5),))
    cut = replace(page, verdict=replace(page.verdict, saturations=Saturations({"b": 7}, {}, 150)))
    told = "In this run: saturated: joint 'b' in 7 of 150 ticks."
    words = _Page(render_page(cut)).words
    assert words.index("fails by 2 mm") < words.index(told) < words.index("Tracking and limits")
    assert told not in _Page(render_page(page)).words


def test_all_that_was_drawn_stands_at_the_head() -> None:
    page = _page()
    drawn = Drawn(3, tuple((f"scene.body_{k}.mass", 0.25) for k in range(9)))
    told = _Page(render_page(replace(page, verdict=replace(page.verdict, drawn=drawn)))).words
    assert "scene.body_7.mass=0.25, scene.body_8.mass=0.25" in told


def test_what_the_log_lacks_is_said() -> None:
    assert "The log is incomplete: cut" in _Page(render_page(replace(_page(), lost="cut"))).words


def test_numbers_are_those_of_the_facts() -> None:
    words = _Page(render_page(_page())).words
    for told in ("5.5 N", "4.0 N to 6.0 N", "4.2 mm", "at 1.50 s; 1.0 mm at the end", "7.7 J", "15.0 W", "0.57 deg",
                 "97 %", "36.0 of 20 mm", "7 ticks", "motor 3 ticks", "110 %", "44.0 of 40 N m",
                 "+0.20 s"):  # fmt: skip
        assert told in words, told


@pytest.mark.parametrize(
    ("value", "told"),
    [
        (0.04 + 4.6e-8, "at 40 mm"),
        (0.04 - 4.6e-8, "at 40 mm"),
        (0.041, "1.0 mm beyond 40 mm"),
        (0.03, "10.0 mm from"),
    ],
)
def test_a_joint_that_rests_on_its_limit_is_at_it(value: float, told: str) -> None:
    page, facts = _page(), _facts()
    use = Use(value / 0.04, value, 0.04, 1.0)
    joint = replace(facts.joints[0], unit="m", position=use)
    assert told in _Page(render_page(replace(page, facts=replace(facts, joints=(joint,))))).words


@pytest.mark.parametrize(
    ("shown", "text"),
    [
        (signed(-0.0161, "m"), "−16.1 mm"), (signed(0.0, "N"), "0 N"), (signed(2.0, "s"), "+2.0 s"),
        (number(0.0004, "J"), "0 J"), (number(0.05, "J"), "0.05 J"), (number(7.66, "J"), "7.7 J"),
        (number(123.4, "W"), "123 W"),
        (of_limit(0.0063, 0.02, "m"), "6.3 of 20 mm"), (of_limit(-0.001, -40.0, "N m"), "0.0 of −40 N m"),
        (of_limit(14.549, 60.0, "s"), "14.5 of 60 s"), (of_limit(0.0, np.radians(5), "rad"), "0.00 of 5 deg"),
    ],
)  # fmt: skip
def test_how_numbers_are_written(shown: str, text: str) -> None:
    assert shown == text


@pytest.mark.slow
def test_a_task_that_was_refused_has_a_page_and_junit(call_cli: RunCli, tmp_path: Path) -> None:
    task = ROOT / "tasks" / "home.yaml"
    page, junit = tmp_path / "r.html", tmp_path / "j.xml"
    spec = load_task(task).spec
    words = [
        "--set",
        "steps.0.follow.points.0.positions.3=99",
        "--report",
        page,
        "--junit",
        junit,
        "--format",
        "json",
    ]
    ran = call_cli("run", task, *words, cwd=tmp_path)
    assert ran.code == 1 and json.loads(ran.out)["log"] is None
    shown = _Page(page.read_text("utf-8"))
    step = spec.steps[0].id
    assert f"✗ step '{step}' failed" in shown.words and "cannot be planned" in shown.words
    assert "not run: the task was refused" in shown.words
    assert any("marked" in (a.get("class") or "") for _, a in shown.found)
    assert "cannot be planned" in junit.read_text("utf-8")


@pytest.mark.parametrize(
    ("text", "place"), [("task: [\n", "bad.yaml:2:1"), ("task: pour\nrobt: x.yaml\nsteps: []\n", "bad.yaml:2:1")]
)
def test_an_invalid_task_has_a_page_and_junit_in_place_of_those_of_an_earlier_run(
    call_cli: RunCli, tmp_path: Path, text: str, place: str
) -> None:
    (tmp_path / "bad.yaml").write_text(text)
    for name in ("r.html", "j.xml"):
        (tmp_path / name).write_text("passed")
    ran = call_cli("run", "bad.yaml", "--report", "r.html", "--junit", "j.xml", cwd=tmp_path)
    assert ran.code == 4
    shown = _Page((tmp_path / "r.html").read_text("utf-8"))
    assert "✗ error" in shown.words and place in shown.words and text.split("\n")[0] in shown.words
    ids = {a.get("id") for _, a in shown.found}
    assert all((a.get("href") or "")[1:] in ids for tag, a in shown.found if tag == "a")
    suite = ElementTree.parse(tmp_path / "j.xml").getroot()
    assert (suite.get("errors"), suite.get("failures")) == ("1", "0")
    error = next(suite.iter("error"))
    assert place in (error.text or "") and error.get("message", "").split(" (and")[0] in shown.words
    (case,) = suite.iter("testcase")
    assert f"bad.yaml:{case.get('line')}:" in ran.err and case.get("file") == "bad.yaml"


@pytest.mark.parametrize("data", [None, b"", b"no log"])
def test_a_log_that_cannot_be_read_has_a_page_and_junit_in_place_of_those_of_an_earlier_one(
    call_cli: RunCli, tmp_path: Path, data: bytes | None
) -> None:
    if data is not None:
        (tmp_path / "run.mcap").write_bytes(data)
    (tmp_path / "r.html").write_text("passed")
    ran = call_cli("judge", "run.mcap", "--report", "r.html", "--junit", "j.xml", cwd=tmp_path)
    assert ran.code == 4
    words = _Page((tmp_path / "r.html").read_text("utf-8")).words
    (error,) = ElementTree.parse(tmp_path / "j.xml").getroot().iter("error")
    assert "✗ error" in words and error.get("message", "-") in words and "task was refused" not in words


@pytest.mark.parametrize("option", ["--report", "--junit"])
def test_where_nothing_can_be_written_is_told_before_the_run(call_cli: RunCli, tmp_path: Path, option: str) -> None:
    task = ROOT / "tasks" / "home.yaml"
    (tmp_path / "taken").touch()
    ran = call_cli("run", task, option, tmp_path / "taken" / "file", cwd=tmp_path)
    assert ran.code == 4 and "cannot create folder" in ran.err
    assert not (tmp_path / "runs").exists()
    assert "the command already uses this file" in call_cli("run", task, option, task, cwd=tmp_path).err


@pytest.fixture(scope="module")
def failed(run_cli: RunCli, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a pick that a slippery block makes fail, unwarned: its log, its page and its JUnit file."""
    folder = tmp_path_factory.mktemp("run")
    task = next((ROOT / "examples" / "02_pick_a_block").glob("task*.yaml"))
    slippery = ["--set", "vary={scene.block.friction: {uniform: [0.02, 0.03]}}", "--sample", "0"]
    words = [*slippery, "--log", "run.mcap", "--report", "r.html", "--junit", "r.xml", "-q"]
    assert run_cli("run", task, *words, cwd=folder).code == 1
    assert sorted(path.name for path in folder.iterdir()) == ["r.html", "r.xml", "run.mcap"]
    return folder


@pytest.mark.slow
def test_judge_makes_the_page_that_run_made(call_cli: RunCli, failed: Path, tmp_path: Path) -> None:
    words = ["--report", "j.html", "--junit", "j.xml", "--package-path", ROOT / "robots"]
    assert call_cli("judge", failed / "run.mcap", *words, cwd=tmp_path).code == 1
    page = (failed / "r.html").read_bytes()
    assert page == (tmp_path / "j.html").read_bytes()
    assert len(page) < 3_000_000
    assert "Why it failed" in _Page(page.decode()).words
    assert (failed / "r.xml").read_text("utf-8").count("<failure") == (tmp_path / "j.xml").read_text().count("<failure")


@pytest.mark.slow
def test_what_a_killed_run_left_has_a_page_that_says_so(call_cli: RunCli, failed: Path, tmp_path: Path) -> None:
    data = (failed / "run.mcap").read_bytes()
    (tmp_path / "run.mcap.partial").write_bytes(data[: len(data) * 6 // 10])
    ran = call_cli("judge", "run.mcap.partial", "--report", "r.html", "--junit", "j.xml", cwd=tmp_path)
    assert ran.code == 3
    words = _Page((tmp_path / "r.html").read_text("utf-8")).words
    assert "✗ error" in words and "The log is incomplete" in words and "What went wrong" in words
    assert "<error" in (tmp_path / "j.xml").read_text("utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("plan", [b'{"steps": [{"id": "pick_1", "ve', b'{"steps": [{"id": 1}]}', b"[]"])
def test_a_log_whose_plan_is_spoilt_has_a_page_and_junit_of_the_steps_that_began(
    call_cli: RunCli, failed: Path, tmp_path: Path, rewrite_log: Callable[..., Path], plan: bytes
) -> None:
    rewrite_log(
        failed / "run.mcap",
        tmp_path / "run.mcap",
        attachment=lambda name, data: plan if name == "plan.json" else data,
    )
    words = ["--report", "j.html", "--junit", "j.xml", "--package-path", ROOT / "robots", "--format", "json"]
    ran = call_cli("judge", "run.mcap", *words, cwd=tmp_path)
    assert ran.code == 1, ran.err
    begun = [step["id"] for step in json.loads(ran.out)["steps"]]
    whole = (failed / "r.html").read_text("utf-8")
    shown = _Page((tmp_path / "j.html").read_text("utf-8"))
    assert begun and all(one in shown.words and one in whole for one in begun)
    cases = [one.get("name") for one in ElementTree.parse(tmp_path / "j.xml").getroot().iter("testcase")]
    assert cases[1 : 1 + len(begun)] == begun


def test_attempts_and_what_may_fail_are_told() -> None:
    page = _page()
    attempt = Attempt("failed", 0.0, 1.0)
    first = replace(page.verdict.steps[0], attempts=(attempt, attempt), replanned=("the cup had moved",))
    second = replace(page.verdict.steps[1], tolerated=True)
    verdict = replace(page.verdict, steps=(first, second, page.verdict.steps[2]))
    words = _Page(render_page(replace(page, verdict=verdict))).words
    assert "at attempt 2" in words and "re-planned: the cup had moved" in words and "– failed, may fail" in words


def test_an_error_of_a_run_is_told_like_any_cause() -> None:
    finding = Diagnostic("RUN101", "the run was interrupted")
    verdict = replace(_page().verdict, verdict="error", errors=(finding,))
    page = replace(_page(), verdict=verdict, causes=(Cause(finding.message, "", 2.0),))
    words = _Page(render_page(page)).words
    assert words.index("✗ error") < words.index("✗ the run was interrupted")
