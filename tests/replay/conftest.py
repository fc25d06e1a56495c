"""A headless Chromium for the tests of pages."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.browser import PROGRAM, Page, started


@pytest.fixture
def browser(tmp_path: Path) -> Iterator[Page]:
    """An empty page of a Chromium of its own."""
    if PROGRAM is None:
        pytest.skip("no Chromium is installed (Debian: apt-get install chromium)")
    with started(PROGRAM, tmp_path / "profile") as page:
        yield page
