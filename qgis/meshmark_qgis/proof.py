"""The proof that a run made its copy: an exit code or a file, which may be older, is not enough."""

import json
import os

from qgis.core import QgsProcessingException

from .text import tr


class Proof:
    """The state before a copy is made; the places of its record and reference are free."""

    def __init__(self, output, record, reference):
        self._output, self._record, self._reference = output, record, reference
        self._before = identity(output)

    def check(self, recipient, message):
        """Raises unless the file is new, with a reference and a record of this subject."""
        found = self._found()
        expected = ("recipient", recipient) if recipient else ("message", message.lower())
        is_new = identity(self._output) not in (None, self._before)
        if not is_new or not os.path.exists(self._reference) or found.get(expected[0]) != expected[1]:
            raise QgsProcessingException(
                tr(
                    "No copy for {} was made although no error was reported: do not hand out {}, and export"
                    " again to another file."
                ).format(recipient or message, self._output)
            )

    def _found(self):
        try:
            with open(self._record, encoding="utf-8") as file:
                found = json.load(file)
        except (OSError, ValueError):
            return {}
        return found if isinstance(found, dict) else {}


def identity(path):
    """Returns an identity that no two files of a place share; None without a file."""
    try:
        status = os.stat(path)
    except OSError:
        return None
    return status.st_dev, status.st_ino, status.st_mtime_ns, status.st_ctime_ns
