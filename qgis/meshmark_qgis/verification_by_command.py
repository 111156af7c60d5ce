"""Verification, comparison and new keys with the command `meshmark`, in a process that can be stopped."""

import json

from qgis.core import QgsFeedback, QgsProcessingException

from . import commands
from .algorithm import sentences
from .text import tr

# Exit codes with which the command gives a verdict: match, no match, inconclusive.
VERDICTS = (0, 1, 3)


def find():
    """Raises Missing unless the command is installed."""
    commands.meshmark()


def writes_report(subcommand):
    """Returns whether the installed version writes reports of a subcommand."""
    return commands.has_option(subcommand, "--report")


def verify(request, feedback):
    """Returns the report as data; writes report and evidence map."""
    marks = ["--record", request.record] if request.record else ["--records", request.records]
    arguments = [commands.meshmark(), "verify", "--json", "--key", request.key, *marks]
    arguments += ["--evidence-map", request.evidence] if request.evidence else []
    arguments += ["--report", request.report] if request.report else []
    arguments += ["--exact-displacements"] if request.is_exact else []
    arguments += ["--reference", request.reference, "--", request.suspect]
    return answer(commands.run(arguments, feedback), VERDICTS, feedback)


def compare(request, feedback):
    """Returns the comparison as data; writes the report."""
    arguments = [commands.meshmark(), "compare", "--json"]
    arguments += ["--report", request.report] if request.report else []
    arguments += ["--layers", request.layers] if request.layers else []
    arguments += ["--precision", repr(request.precision)] if request.precision is not None else []
    arguments += ["--", request.original, request.marked]
    return answer(commands.run(arguments, feedback), (0,), feedback)


def make_key(path):
    """Makes a key in a new file that only its owner can read."""
    finished = commands.run([commands.meshmark(), "keygen", "--", path], QgsFeedback())
    if finished.code != 0:
        errors, _ = sentences(finished.errors)
        ended = tr("meshmark ended with exit code {}.").format(finished.code)
        raise QgsProcessingException("\n".join(errors or [ended]))


def answer(finished, codes, feedback):
    """Returns the JSON of the command; raises its error message when it failed."""
    errors, _ = sentences(finished.errors)
    if finished.code not in codes:
        ended = tr("meshmark ended with exit code {}.").format(finished.code)
        raise QgsProcessingException("\n".join(errors or [ended]))
    for line in errors:
        feedback.pushWarning(line)
    try:
        found = json.loads(finished.output)
    except ValueError:
        found = None
    if not isinstance(found, dict) or not {"meshmark_report", "meshmark_comparison"} & found.keys():
        raise QgsProcessingException(
            tr(
                "The output of {} is not readable: is it the command meshmark, in this version? See Settings >"
                " Options > meshmark."
            ).format(commands.meshmark())
        )
    return found
