"""The browser of the tests of pages serves the site too."""

from tests.page.conftest import browser

__all__ = ["browser"]
