"""`manipcli bless`, ended before its last task."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

from manipcli.batch.job import Job
from manipcli.cli.app import main
from manipcli.report.suite.suite import CaseReport

ROOT = Path(__file__).parents[2]
TASK = f"""\
task: {{name}}
robot: {ROOT}/robots/arm7_hand3/robot.yaml
controllers: {ROOT}/controllers/arm7_hand3.yaml
steps: [{{{{wait: 1 s}}}}]
"""


@pytest.mark.parametrize("format_", ["json", "text"])
def test_an_interruption_keeps_what_was_told_of_the_tasks_before(
    format_: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(jobs: Iterable[Job], **_: object) -> Iterator[CaseReport]:
        for job in jobs:
            if job.case.task == "b":
                raise KeyboardInterrupt
            yield CaseReport(job.case, "failed", 1.0, job.command(), "late")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("manipcli.batch.process.run_jobs", interrupted)
    for name in ("a", "b"):
        (tmp_path / f"{name}.yaml").write_text(TASK.format(name=name))
    assert main(["bless", "--format", format_]) == 2
    out, err = capsys.readouterr()
    assert err == ""
    if format_ == "text":
        assert out.startswith("✗ a.yaml::a failed\n")
        assert "✗ 1 failed, 1 not run in 0." in out
        assert out.endswith(" s, 1 process; interrupted\n")
        return
    answer = json.loads(out)
    assert (answer["stopped"], answer["total"], answer["not_run"]) == ("interrupted", 2, ["b.yaml::b"])
    assert [(case["id"], case["outcome"]) for case in answer["cases"]] == [("a.yaml::a", "failed")]
