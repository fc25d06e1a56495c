"""What a page about a run is made of. One value, made from a log alone, or from a task that was refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from manipcli.core.errors import Diagnostic
from manipcli.judge.measures.facts import RunFacts
from manipcli.judge.verdict import ExpectationOutcome, StepOutcome, Verdict
from manipcli.replay.playback import Playback


@dataclass(frozen=True, slots=True)
class Source:
    """A file that is shown with its lines. `name` is that of the file, `text` what stands in it."""

    name: str
    text: str


@dataclass(frozen=True, slots=True)
class Written:
    """Where a step or an expectation stands.

    Attributes:
        place: `pour.yaml:13`, as the user wrote it; "" where that is not known.
        line: its line in the file that the page shows under `Source.name` `file`; 0 where it is in none.
    """

    place: str
    file: str = ""
    line: int = 0


@dataclass(frozen=True, slots=True)
class Picture:
    """A moment: `data` is a WebP file, `time` [s] of the run."""

    time: float
    data: bytes
    size: tuple[int, int]


@dataclass(frozen=True, slots=True)
class Cause:
    """Why a run did not pass. `at` [s]: when it was worst; None where it has no time."""

    title: str
    text: str
    at: float | None = None
    written: Written | None = None
    hint: str = ""


@dataclass(frozen=True)
class RunPage:
    """Everything that the page says.

    Attributes:
        verdict: of the log.
        log: its name, also where it cannot be read; "" where nothing was run.
        lost: why its end is missing, or None.
        causes: why it did not pass, the first cause first.
        steps, expectations: where each stands, parallel to those of the verdict.
        limits: of each expectation the most that its margin can be, in its unit; None where that is not stated.
        facts: what was measured; None where nothing was run or the log cannot be read.
        playback: what is replayed; None where nothing was run.
        pictures: of steps, by id.
        moment: what it looked like when the first cause was worst.
        sources: the resolved files.
        provenance: name and value of what is known of the origin: versions, seed, engine, period.
        hashes: SHA-256 of files, by name.
        notes: what is missing or unlike it was in the run, a sentence each.
        warnings: what was doubted before the run began; none where the page is made of a log that was there already.
        index: where, from this page, the one is that leads to it and others; "" where there is none.
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
        """Each step and where it stands."""
        return tuple(zip(self.verdict.steps, self.steps, strict=True))

    @property
    def judged(self) -> tuple[tuple[ExpectationOutcome, Written, float | None], ...]:
        """Each expectation, where it stands, and its limit."""
        return tuple(zip(self.verdict.expectations, self.expectations, self.limits, strict=True))
