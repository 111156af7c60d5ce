"""The programs the plugin runs: `meshmark` and GDAL's `ogr2ogr`. A run can be cancelled."""

import contextlib
import os
import re
import shutil
import subprocess
import sys
import threading
from collections import namedtuple

from qgis.core import QgsApplication

from . import driver, settings
from .missing import Misnamed, Missing
from .text import tr

Finished = namedtuple("Finished", "code output errors")

# Interval between checks of a running program, seconds.
PATIENCE = 0.1
# Time a program has to end after the request to do so, seconds.
GRACE = 5


class Cancelled(Exception):
    """The user cancelled, and the program was stopped."""

    def __init__(self):
        super().__init__(tr("Cancelled: nothing was written."))


def meshmark():
    """Returns the path of the command meshmark."""
    path = settings.get(settings.COMMAND)
    if path and not shutil.which(path):
        raise Misnamed(
            tr(
                "{} is not a program that can be run: correct the path of the command meshmark in Settings >"
                " Options > meshmark."
            ).format(path)
        )
    found = path or shutil.which("meshmark")
    if not found:
        raise Missing(
            tr(
                "The command meshmark is not installed: install meshmark (package meshmark, or `make install` in"
                " its sources), or name its path in Settings > Options > meshmark."
            )
        )
    return found


def ogr2ogr():
    """Returns the path of GDAL's ogr2ogr, preferably that of this QGIS."""
    beside = os.path.join(QgsApplication.prefixPath(), "bin", "ogr2ogr")
    found = shutil.which(beside) or shutil.which("ogr2ogr")
    if not found:
        raise Missing(tr("GDAL's command ogr2ogr is not installed: install it (package gdal-bin)."))
    return found


def has_option(subcommand, option):
    """Returns whether `meshmark SUBCOMMAND` of the installed version has an option."""
    with _startable(meshmark()):
        asked = subprocess.run([meshmark(), subcommand, "--help"], capture_output=True, **_without_window())
    return re.search(rb"^\s+%s\b" % re.escape(option.encode()), asked.stdout, re.MULTILINE) is not None


def run(arguments, feedback, on_output=lambda text: None):
    """Runs a program to its end; `on_output` receives its output. Raises Cancelled."""
    with _startable(arguments[0]):
        process = subprocess.Popen(
            arguments,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=driver.environment(),
            **_without_window(),
        )
    output, errors = bytearray(), bytearray()
    readers = [
        threading.Thread(target=_drain, args=pair, daemon=True)
        for pair in [(process.stdout, output), (process.stderr, errors)]
    ]
    for reader in readers:
        reader.start()
    with process:
        while _is_running(process):
            on_output(output.decode(errors="replace"))
            if feedback.isCanceled():
                _stop(process)
                raise Cancelled()
        for reader in readers:
            reader.join()
    return Finished(process.returncode, output.decode(errors="replace"), errors.decode(errors="replace"))


@contextlib.contextmanager
def _startable(program):
    """Reports a program that the system cannot start, such as one for another machine."""
    try:
        yield
    except OSError as error:
        raise Misnamed(
            tr("{} cannot be started ({}): correct its path in Settings > Options > meshmark, or install it again.").format(
                program, error.strerror or error
            )
        ) from error


def _is_running(process):
    try:
        process.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        return True
    return False


def _drain(stream, into):
    while True:
        read = os.read(stream.fileno(), 1 << 16)
        if not read:
            return
        into.extend(read)


def _stop(process):
    process.terminate()
    try:
        process.wait(GRACE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _without_window():
    return {"creationflags": subprocess.CREATE_NO_WINDOW} if sys.platform == "win32" else {}
