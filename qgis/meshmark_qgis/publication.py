"""Files that appear in their places together, or none of them: those of an export without the driver.

They are made in workplaces, private folders beside their places. The order is record, reference, side
files, main file; so a reader that sees the main file finds the others. Companions are linked where the
file system has links: a file in both places shows that a publication was interrupted. The journal of a
workplace tells the next export to its folder what a killed one had begun, so that it can be undone.
"""

import contextlib
import json
import os
import shutil
import tempfile
import traceback

from qgis.core import QgsProcessingException
from qgis.PyQt.QtCore import QLockFile

from .text import tr

PREFIX = ".meshmark-qgis-"
LOCK, JOURNAL, PEERS = "lock", "journal.json", "peers.json"
# Files that readers of Shapefiles would take for parts of a new one.
OF_SHAPEFILE = ("dbf", "shx", "prj", "cpg", "qix", "sbn", "sbx", "qpj", "idm", "ind")


class Workplaces:
    """Workplaces in folders, which are removed at the end; those of killed processes are removed at the
    beginning, and what these had begun is undone."""

    def __init__(self, *folders):
        self._folders = list(dict.fromkeys(os.path.realpath(folder) for folder in folders))
        self._made = {}

    def __enter__(self):
        try:
            for folder in self._folders:
                self._made[folder] = _locked(folder)
            for path, _ in self._made.values():
                _write(os.path.join(path, PEERS), [other for other, _ in self._made.values() if other != path])
            for folder in self._folders:
                _sweep(folder)
        except OSError as error:
            self._remove()
            raise QgsProcessingException(str(error)) from error
        return self

    def __exit__(self, _kind, _error, trace):
        # Datasets that the frames of an exception hold are open, and Windows removes no file that is.
        if trace is not None:
            traceback.clear_frames(trace)
        self._remove()

    def of(self, folder):
        """Returns the workplace in a folder."""
        return self._made[os.path.realpath(folder)][0]

    def _remove(self):
        for path, lock in self._made.values():
            # Without its journal it does not count as an interrupted publication.
            with contextlib.suppress(OSError):
                os.remove(os.path.join(path, JOURNAL))
            lock.unlock()
            shutil.rmtree(path, ignore_errors=True)


def publish(workplace, companions, main, replaces):
    """Moves files to their places, all of them or none: `companions` and `main` are pairs of paths, the present
    and the new one. `main` alone may replace a file, with its side files. `workplace` is that of `main`."""
    retired = []
    if replaces and os.path.isfile(main[1]):
        kept = os.path.join(workplace, "replaced")
        os.mkdir(kept)
        retired = [(path, os.path.join(kept, os.path.basename(path))) for path in side_files(main, companions)]
    moves = {"retired": retired, "companions": companions, "main": main}
    try:
        for present, _ in [*companions, main]:
            _sync(present)
        _write(os.path.join(workplace, JOURNAL), moves)
        for present, new in retired:
            os.rename(present, new)
        for present, new in companions:
            _link(present, new)
        if replaces:
            os.replace(*main)
        else:
            _link(*main)
    except OSError as error:
        _undo(moves)
        taken = isinstance(error, FileExistsError)
        text = tr("{} exists: move it away, or give another name.").format(error.filename2) if taken else str(error)
        raise QgsProcessingException(text) from error


def side_files(main, companions):
    """Returns the files of a replaced dataset other than its main file."""
    made, target = main
    names = {os.path.basename(path) for path, _ in companions if os.path.dirname(path) == os.path.dirname(made)}
    stem = os.path.splitext(os.path.basename(target))[0]
    if names:
        names.update(f"{stem}.{ending}" for ending in OF_SHAPEFILE)
    paths = [os.path.join(os.path.dirname(target), name) for name in sorted(names)]
    return [path for path in paths if path != target and os.path.isfile(path)]


def _locked(folder):
    """Returns a new workplace and its lock."""
    while True:
        path = tempfile.mkdtemp(prefix=PREFIX, dir=folder)
        lock = QLockFile(os.path.join(path, LOCK))
        lock.setStaleLockTime(0)
        # Another process may remove it before it is locked.
        if lock.tryLock(0):
            return path, lock
        if os.path.isdir(path):
            os.rmdir(path)
            raise QgsProcessingException(tr("The folder {} cannot be locked: choose another.").format(folder))


def _sweep(folder):
    """Removes the workplaces in a folder whose processes have ended."""
    for entry in os.scandir(folder):
        if entry.name.startswith(PREFIX) and entry.is_dir(follow_symlinks=False):
            _sweep_one(entry.path)


def _sweep_one(path):
    lock = QLockFile(os.path.join(path, LOCK))
    lock.setStaleLockTime(0)
    if not os.path.isdir(path) or not lock.tryLock(0):
        return
    peers = _read(os.path.join(path, PEERS)) or []
    for workplace in [path, *peers]:
        moves = _read(os.path.join(workplace, JOURNAL))
        if moves and not _is_done(moves):
            _undo(moves)
    lock.unlock()
    for workplace in [path, *peers]:
        if os.path.basename(workplace).startswith(PREFIX):
            shutil.rmtree(workplace, ignore_errors=True)


def _is_done(moves):
    present, new = moves["main"]
    return not os.path.exists(present) or _is_same(present, new)


def _undo(moves):
    for present, new in moves["companions"]:
        with contextlib.suppress(OSError):
            if _is_same(present, new):
                os.remove(new)
            elif not os.path.exists(present):
                os.rename(new, present)
    for present, new in moves["retired"]:
        with contextlib.suppress(OSError):
            if os.path.exists(new) and not os.path.exists(present):
                os.rename(new, present)


def _is_same(one, other):
    return os.path.exists(one) and os.path.exists(other) and os.path.samefile(one, other)


def _link(present, new):
    """Gives a file a second name that must be free; a new name where the file system has no links."""
    try:
        os.link(present, new)
    except FileExistsError:
        raise
    except OSError:
        if os.path.lexists(new):
            raise FileExistsError(0, "", present, None, new) from None
        os.rename(present, new)


def _write(path, value):
    with open(path, "w", encoding="utf-8") as file:
        json.dump(value, file)
        file.flush()
        os.fsync(file.fileno())


def _read(path):
    """Returns the value of a file; None where there is none, or it was not written to its end."""
    try:
        with open(path, encoding="utf-8") as file:
            return json.load(file)
    except (OSError, ValueError):
        return None


def _sync(path):
    """Writes the content to disk: a power failure after the names are in place must not leave empty files."""
    with open(path, "rb+") as file:
        os.fsync(file.fileno())
