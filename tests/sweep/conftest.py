"""The browser of the tests of pages."""

from tests.replay.conftest import browser

__all__ = ["browser"]
