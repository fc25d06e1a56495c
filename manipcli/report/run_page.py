"""Content of the page of a run, from its log alone or from a refused task."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from manipcli.core.errors import Diagnostic
from manipcli.judge.measures.facts import RunFacts
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, Verdict
from manipcli.replay.cause import Cause, Written
from manipcli.replay.playback import Playback


@dataclass(frozen=True, slots=True)
class Source:
    """A file shown with line numbers: its `name` and its `text`."""

    name: str
    text: str


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture of the run: `data` is a WebP file, `time` is in s from the start of the run."""

    time: float
    data: bytes
    size: tuple[int, int]


@dataclass(frozen=True)
class RunPage:
    """Content of the page.

    Attributes:
        verdict: verdict on the log.
        log: name of the log, even if it cannot be read; "" if nothing was run.
        lost: why the end of the log is missing, or None.
        causes: why the run did not pass, the first cause first.
        steps, expectations: where each is written, parallel to those of the verdict.
        limits: largest possible margin of each expectation, in its unit; None if unknown.
        facts: measurements; None if nothing was run or the log cannot be read.
        playback: replay of the run; None if nothing was run.
        pictures: pictures of the steps, by step id.
        moment: picture at the time of the first cause.
        sources: the resolved files.
        provenance: names and values of versions, seed, engine and control period.
        hashes: file names and their SHA-256.
        notes: what is missing or differs from the run, one sentence each.
        warnings: warnings from before the run; empty for the page of an existing log.
        index: relative URL of the index of all runs; "" if there is none.
    """

    verdict: Verdict
    log: str = ""
    lost: str | None = None
    causes: tuple[Cause, ...] = ()
    steps: tuple[Written, ...] = ()
    expectations: tuple[Written, ...] = ()
    limits: tuple[float | None, ...] = ()
    facts: RunFacts | None = None
    playback: Playback | None = None
    pictures: Mapping[str, Picture] = field(default_factory=dict)
    moment: Picture | None = None
    sources: tuple[Source, ...] = ()
    provenance: tuple[tuple[str, str], ...] = ()
    hashes: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()
    index: str = ""

    @property
    def located_steps(self) -> tuple[tuple[StepOutcome, Written], ...]:
        """Each step and where it is written."""
        return tuple(zip(self.verdict.steps, self.steps, strict=True))

    @property
    def judged(self) -> tuple[tuple[ExpectationOutcome, Written, float | None], ...]:
        """Each expectation, where it is written, and its limit."""
        return tuple(zip(self.verdict.expectations, self.expectations, self.limits, strict=True))
