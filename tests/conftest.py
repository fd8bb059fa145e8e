"""The order of the tests: those that run the workflow take longest and come first, so that none is left at the end."""


def pytest_collection_modifyitems(items):
    """Put the tests marked ``workflow`` first, all else in its order."""
    items.sort(key=lambda item: item.get_closest_marker("workflow") is None)
