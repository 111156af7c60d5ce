"""The working folder, in which the hosts read and write."""

import contextlib
import os


def state():
    """Returns name and content of every file in the folder, including hidden files and folders."""
    found = {}
    for folder, folders, files in os.walk("."):
        found.update((os.path.join(folder, name), None) for name in folders)
        for name in files:
            with open(os.path.join(folder, name), "rb") as file:
                found[os.path.join(folder, name)] = file.read()
    return found


@contextlib.contextmanager
def unchanged(what):
    """Fails unless the folder is the same afterwards, byte by byte."""
    before = state()
    yield
    after = state()
    different = sorted(name for name in before.keys() | after.keys() if before.get(name, 0) != after.get(name, 0))
    assert not different, f"{what}: changed or left behind: {different}"
    print(f"passed: {what}: everything is as it was", flush=True)
