"""The choice of what does the work: the GDAL driver and the command meshmark where they are installed,
otherwise the Python package meshmark in QGIS's own Python."""

from . import marking_by_driver, marking_by_package, verification_by_command, verification_by_package
from .missing import Misnamed, Missing


def marking():
    """Returns the module that marks; raises Missing, with both remedies, when there is none."""
    return _chosen(marking_by_driver, marking_by_package)


def verification():
    """Returns the module that verifies, compares and makes keys; raises Missing, with both remedies."""
    return _chosen(verification_by_command, verification_by_package)


def _chosen(programs, package):
    try:
        programs.find()
        return programs
    except Misnamed:
        raise
    except Missing as missing:
        try:
            package.find()
        except Missing as other:
            raise Missing(f"{missing} {other}") from missing
        return package
