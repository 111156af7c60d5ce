"""The report of a verification or comparison: its parameters, and its display after the run."""

import os

from qgis.core import QgsProcessingParameterBoolean, QgsProcessingParameterFileDestination
from qgis.PyQt.QtCore import QUrl
from qgis.PyQt.QtGui import QDesktopServices

from . import engines
from .text import tr


def add_parameters(algorithm):
    algorithm.add(
        QgsProcessingParameterFileDestination(
            "REPORT", tr("Report"), tr("HTML files (*.html)"), optional=True, createByDefault=True
        ),
        tr("A report to read, print and pass on; it contains no secret."),
    )
    algorithm.add(
        QgsProcessingParameterBoolean("OPEN_REPORT", tr("Open the report"), True),
        tr("Opens the report in the web browser after the run."),
    )


class Report:
    """The report of one run; `path` is empty when none is written."""

    def __init__(self, algorithm, given, context, feedback):
        self.path = algorithm.parameterAsFileOutput(given, "REPORT", context)
        self._is_opened = algorithm.parameterAsBool(given, "OPEN_REPORT", context)
        if self.path and not engines.verification().writes_report(algorithm.NAME):
            feedback.pushWarning(tr("This version of the command meshmark writes no report: install a later one."))
            self.path = ""

    def open(self):
        """Opens the report, in the main thread, where QGIS has a window."""
        from qgis.utils import iface

        if iface is not None and self._is_opened and os.path.exists(self.path):
            QDesktopServices.openUrl(QUrl.fromLocalFile(self.path))
