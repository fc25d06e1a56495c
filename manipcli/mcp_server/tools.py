"""Tools over the files of a folder: each is a command of manipcli, run in a process of its own."""

from __future__ import annotations

import re
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Annotated, Any, Final

from pydantic import Field

from manipcli.core.errors import ExitCode
from manipcli.mcp_server.child import Runner
from manipcli.mcp_server.folder import LONGEST, Outside

_CODE = re.compile(r"[A-Za-z]{2,8}\d{3}")
_RESULTS: Final = (ExitCode.PASSED, ExitCode.FAILED)
"""Exit codes of a command that did its work."""

TaskPath = Annotated[str, Field(description="Task file (YAML), a path relative to the folder.")]
Overrides = Annotated[
    list[str],
    Field(
        description="Fields to override, as A.B=VALUE (simulation.seed=3, robot.A.B, controllers.A.B).", max_length=50
    ),
]
Number = Annotated[int | None, Field(ge=0)]


class Failed(Exception):
    """A tool that could not do its work; the text is for the model."""


@dataclass(frozen=True, slots=True)
class Tools:
    """`runner`: starts the commands. Each public method but `command` is a tool; its docstring is for the model."""

    runner: Runner

    @property
    def all(self) -> Sequence[Callable[..., Awaitable[Any]]]:
        """The tools."""
        return (self.check, self.plan, self.run, self.judge, self.explain)

    async def check(
        self,
        files: Annotated[
            list[str], Field(description="Task, robot, controllers, URDF or xacro files.", min_length=1, max_length=50)
        ],
        overrides: Overrides = [],  # noqa: B006 (the schema shows it)
        strict: Annotated[bool, Field(description="Fail on warnings, too.")] = False,
        seed: Number = None,
        sample: Number = None,
    ) -> str:
        """Check files: every finding with its place (file:line:column), what was expected and a hint. A task is also
        planned, and its gains, motors and grasps are examined. Nothing is simulated; do this before `run`."""
        words = ["check", *(["--strict"] if strict else []), *options(overrides, seed=seed, sample=sample)]
        return await self.command(words, files)

    async def plan(
        self,
        task: TaskPath,
        overrides: Overrides = [],  # noqa: B006
        why: Annotated[bool, Field(description="If there is no plan, search longer and show all refusals.")] = False,
        seed: Number = None,
        sample: Number = None,
    ) -> str:
        """Plan a task without simulating it: the motions of each step, what limits them, margins and clearances; or
        which candidates of which step were refused, and why."""
        words = ["plan", *(["--why"] if why else []), *options(overrides, seed=seed, sample=sample)]
        return await self.command(words, [task])

    async def run(
        self,
        task: TaskPath,
        overrides: Overrides = [],  # noqa: B006
        log: Annotated[str, Field(description="Name of the log in runs/ [default: that of the file].")] = "",
        from_step: Annotated[str, Field(description="Begin at this step, with the state of an earlier run.")] = "",
        state: Annotated[str, Field(description="Log with the state before from_step.")] = "",
        until_step: Annotated[str, Field(description="End after this step.")] = "",
        seed: Number = None,
        sample: Number = None,
    ) -> str:
        """Run a task: check, plan, simulate with physics, record a log under runs/ (replaced if it exists), and judge
        it. Shows the verdict, each step's outcome and each expectation with its margin."""
        words = ["run", f"--log={inside(self.runner.folder.log, log or PurePath(task).stem)}", "--force"]
        part = {"from": from_step, "until": until_step, "state": self._file(state) if state else ""}
        words += [f"--{name}={value}" for name, value in part.items() if value]
        return await self.command([*words, *options(overrides, seed=seed, sample=sample)], [task])

    async def judge(self, log: Annotated[str, Field(description="Log of a run: runs/NAME.mcap.")]) -> str:
        """Judge a run again from its log alone: the verdict, steps and expectations with their margins."""
        return await self.command(["judge"], [log])

    async def explain(
        self,
        subject: Annotated[str, Field(description="Code of a finding (TASK203), or a task file.")],
        overrides: Overrides = [],  # noqa: B006
        values: Annotated[bool, Field(description="Of a task: every value and where it comes from.")] = False,
    ) -> str:
        """Explain the code of a finding (what it means, why, an example with and without the defect), or a task in
        English sentences with resolved numbers."""
        if _CODE.fullmatch(subject):
            return await self.command(["explain", subject], [])
        words = ["explain", *(["--values"] if values else []), *options(overrides)]
        return await self.command(words, [f"./{self._file(subject)}"])

    async def command(self, words: Sequence[str], files: Sequence[str]) -> str:
        """The output of a command over files of the folder.

        Raises:
            Failed: it could not do its work: a file or an argument is invalid, or it took too long.
        """
        paths = [self._file(file) for file in files]
        try:
            found = await self.runner.run([*words, "--quiet", *self.runner.package_options, "--", *paths])
        except TimeoutError:
            raise Failed(f"{words[0]} took longer than {self.runner.limit:g} s and was ended") from None
        if found.code not in _RESULTS:
            raise Failed(found.text or f"{words[0]} ended with exit code {found.code}")
        return found.text

    def _file(self, word: str) -> str:
        return inside(self.runner.folder.file, word)


def inside(resolve: Callable[[str], str], word: str) -> str:
    """A path by a method of the folder.

    Raises:
        Failed: it is outside.
    """
    try:
        return resolve(word)
    except Outside as error:
        raise Failed(str(error)) from None


def options(overrides: Sequence[str], **numbers: int | None) -> list[str]:
    """Options of a command; values are never words of their own, so that none becomes an option."""
    for each in overrides:
        if len(each) > LONGEST or "\0" in each:
            raise Failed(f"an override is a text of at most {LONGEST} characters")
    given = [f"--{name}={value}" for name, value in numbers.items() if value is not None]
    return [*(f"--set={each}" for each in overrides), *given]
