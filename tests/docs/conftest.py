"""How the pages are shared out between processes."""

import pytest


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Puts every other test of the pages at the end of all tests.

    Two processes begin with one half of the tests each: in their usual order, one of them would run
    all pages.
    """
    of_pages = [item for item in items if item.path.name == "test_snippets.py"]
    for item in of_pages[1::2]:
        items.remove(item)
        items.append(item)
