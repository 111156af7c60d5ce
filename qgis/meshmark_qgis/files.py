"""New files: complete or absent, and never in the place of others."""

import contextlib
import os

from qgis.core import QgsProcessingException

from .text import tr


@contextlib.contextmanager
def all_or_nothing(paths):
    """Removes the new files when their writer is cancelled or fails between them."""
    new = [path for path in paths if path and not os.path.lexists(path)]
    try:
        yield
    except BaseException:
        for path in new:
            with contextlib.suppress(FileNotFoundError):
                os.remove(path)
        raise


def check_is_free(path):
    """Raises when a file exists, or its folder does not, before long work begins."""
    if os.path.lexists(path):
        raise QgsProcessingException(tr("{} exists: name another file.").format(path))
    if not os.path.isdir(os.path.dirname(os.path.abspath(path))):
        raise QgsProcessingException(tr("The folder of {} does not exist: make it, or choose another.").format(path))


def write_new(path, content):
    """Writes bytes to a new file; a caller's `all_or_nothing` removes what is incomplete."""
    try:
        with open(path, "xb") as file:
            file.write(content)
    except OSError as error:
        raise QgsProcessingException(tr("{} cannot be written: {}").format(path, error.strerror or error)) from error
