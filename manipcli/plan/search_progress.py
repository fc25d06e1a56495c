"""What a search is trying, as one line: `planning step 3 of 5, 'pick_1': candidate 12, path search`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

PATH_SEARCH: Final = "path search"
"""A path around obstacles is searched."""


class SearchProgress:
    """Reports each step, candidate and path search.

    Args:
        report: receives each line.
        ids: of the steps.
        branch: the outcomes of the choices before the step of this index, in words.
    """

    def __init__(
        self, report: Callable[[str], None], ids: Sequence[str], branch: Callable[[int], str] = lambda _: ""
    ) -> None:
        self._report = report
        self._ids = ids
        self._branch = branch
        self._step = ""
        self._details: tuple[str, ...] = ()

    def step(self, k: int, again: bool) -> None:
        """Step `k` is planned; `again`: with another candidate, as a later step has no plan with the last."""
        branch = self._branch(k)
        where = f" ({branch})" if branch else ""
        self._step = f"planning step {k + 1} of {len(self._ids)}, '{self._ids[k]}'{where}"
        self._details = ("another candidate",) if again else ()
        self._show()

    def candidate(self, number: int) -> None:
        """The `number`-th candidate of the step is tried, from 1."""
        self._details = (f"candidate {number}",)
        if number > 1:
            self._show()

    def doing(self, what: str) -> None:
        """Something of the candidate that takes long begins."""
        self._details = (*self._details[:1], what)
        self._show()

    def _show(self) -> None:
        details = ", ".join(self._details)
        self._report(f"{self._step}: {details}" if details else self._step)
