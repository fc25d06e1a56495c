"""One round of `check --watch`: findings, planned durations, and the schema for editors."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from manipcli.cli import console
from manipcli.cli.progress import PlanningProgress
from manipcli.cli.watch import watch
from manipcli.core.cache import cache_folder
from manipcli.core.errors import ManipcliError


def watch_files(
    files: Sequence[Path],
    *,
    overrides: Sequence[str],
    seed: int | None,
    sample: int | None,
    package_path: Sequence[Path],
    allow_outside: bool,
    format_: str,
    strict: bool,
) -> None:
    """Checks the files after each change until Ctrl-C; see `check_files`.

    Raises:
        KeyboardInterrupt: by Ctrl-C.
    """

    schemas: set[Path] = set()

    def one(changed: tuple[Path, ...]) -> list[Path]:
        from manipcli import pipeline
        from manipcli.report import json, plan_text, text

        if changed:
            console.talk(f"\nchanged: {', '.join(sorted(path.name for path in changed))}")
        written: set[Path] = set()
        # Where tasks share a schema, it has the names of the one that changed last.
        for file in sorted(files, key=lambda file: file.absolute() not in changed):
            if pipeline.kind_of(file) != "task":
                continue
            update = pipeline.updated_schema(
                file, folder=Path.cwd(), package_path=package_path, allow_outside=allow_outside, leave=written
            )
            written |= {update.file} if update.file is not None else set()
            schemas.update(written)
            if update.written:
                console.talk(f"schema: {update.file} now has the names of {file}")
            elif update.why_not:
                console.talk(f"note: {update.why_not}")
        plans: dict[Path, pipeline.Plan] = {}
        with PlanningProgress() as progress:
            findings = pipeline.check_files(
                tuple(files),
                overrides=overrides,
                seed=seed,
                sample=sample,
                package_path=package_path,
                allow_outside=allow_outside,
                on_progress=progress.activity,
                on_plan=plans.__setitem__,
            )
        names = [str(file) for file in files]
        console.result((json if format_ == "json" else text).render_findings(findings, names, strict=strict))
        failed = {finding.place.file for finding in findings if finding.severity == "error" and finding.place}
        for file, plan in plans.items() if format_ == "text" else ():
            if str(file) not in failed:
                console.result(f"\n{file}:\n{plan_text.render_durations(plan)}")
        return [*files, *(Path(finding.place.file) for finding in findings if finding.place and finding.place.line > 0)]

    def guarded(changed: tuple[Path, ...]) -> list[Path]:
        """A round; what goes wrong in it is printed, since a file may have vanished while it was read."""
        from manipcli.report.text import describe

        found = [*files]
        try:
            found = one(changed)
        except ManipcliError as error:
            for finding in error.findings:
                console.error(describe(finding))
        except Exception as error:  # noqa: BLE001 (a file that is being written must not end the watch)
            console.error(f"✗ the check failed: {type(error).__name__}: {error}")
        console.talk("waiting for changes; Ctrl-C stops")
        return found

    folder = cache_folder()

    def own(path: Path) -> bool:
        """Whether the check itself writes this file."""
        return path.resolve() in schemas or (folder is not None and path.is_relative_to(folder))

    watch(guarded, own)
