"""The common part of the three algorithms."""

import os

from qgis.core import QgsProcessingAlgorithm, QgsProcessingException, QgsProcessingParameterDefinition
from qgis.PyQt.QtGui import QIcon

from . import layers
from .commands import Cancelled
from .missing import Missing
from .text import tr

# The messages that ogr2ogr appends to the reason of the driver.
CONSEQUENCE = "MESHMARK driver failed to create "
ICON = os.path.join(os.path.dirname(__file__), "icon.svg")


class Algorithm(QgsProcessingAlgorithm):
    """The base class: a subclass defines NAME, `title`, `about` and the programs it `needs`."""

    NAME = ""

    def title(self):
        raise NotImplementedError

    def about(self):
        raise NotImplementedError

    def needs(self):
        """Raises Missing when a required program is not installed."""
        raise NotImplementedError

    def createInstance(self):
        return type(self)()

    def name(self):
        return self.NAME

    def displayName(self):
        return self.title()

    def icon(self):
        return QIcon(ICON)

    def svgIconPath(self):
        return ICON

    def tags(self):
        return [tr("watermark"), tr("leak"), tr("recipient"), "MESHMARK"]

    def shortHelpString(self):
        hidden = QgsProcessingParameterDefinition.Flag.FlagHidden
        shown = [p for p in self.parameterDefinitions() if p.help() and not p.flags() & hidden]
        items = "".join(f"<h3>{p.description()}</h3><p>{p.help()}</p>" for p in shown)
        return f"<p>{self.about()}</p>{items}"

    def add(self, parameter, help_text):
        """Adds a parameter with its help, which the dialog shows beside it and as a tooltip."""
        parameter.setHelp(help_text)
        # The framework owns the parameter from here on.
        self.addParameter(parameter)

    def createCustomParametersWidget(self, parent=None):
        from .dialog import Dialog

        return Dialog(self, parent=parent)

    def canExecute(self):
        try:
            self.needs()
        except Missing as missing:
            return False, str(missing)
        return True, ""

    def objection(self, parameters, context):
        """Returns why the run cannot begin with this combination of values, None when it can."""
        return None

    def checkParameterValues(self, parameters, context):
        objection = self.objection(parameters, context)
        return (False, objection) if objection else super().checkParameterValues(parameters, context)

    def prepareAlgorithm(self, parameters, context, feedback):
        try:
            self.needs()
        except Missing as missing:
            raise QgsProcessingException(str(missing)) from missing
        # A model does not call checkParameterValues.
        objection = self.objection(parameters, context)
        if objection:
            raise QgsProcessingException(objection)
        return self.prepare(parameters, context, feedback)

    def processAlgorithm(self, parameters, context, feedback):
        # QGIS shows a traceback for any exception except its own class, subclasses included.
        try:
            return self.process(parameters, context, feedback)
        except (Cancelled, Missing) as reason:
            raise QgsProcessingException(str(reason)) from reason

    def prepare(self, parameters, context, feedback):
        """Prepares layers of the project, in the main thread, before the run."""
        raise NotImplementedError

    def process(self, parameters, context, feedback):
        """Runs the algorithm in a thread of its own."""
        raise NotImplementedError

    def map_layer(self, parameters, name, context):
        """Returns the file of a layer, or its visible content as a Snapshot."""
        layer = self.parameterAsVectorLayer(parameters, name, context)
        if layer is None:
            raise QgsProcessingException(self.invalidSourceError(parameters, name))
        return layers.file_of(layer) or layers.Snapshot(layer)


class Inputs:
    """The maps of a run as files. A Snapshot is copied beside the report, which names the copy, or,
    without a report, into a folder that is removed after the run."""

    def __init__(self, report, staging):
        self._base = os.path.splitext(report)[0] + "." if report else os.path.join(staging, "")
        self._is_kept = bool(report)

    def place(self, given, name):
        """Returns the place for a copy of the Snapshot from `map_layer`; None for a file."""
        return None if isinstance(given, str) else f"{self._base}{name}.gpkg"

    def path(self, given, name, context, feedback):
        """Returns the path of the map from `map_layer`; a Snapshot is copied first."""
        place = self.place(given, name)
        if place is None:
            return given
        if os.path.lexists(place):
            raise QgsProcessingException(tr("{} exists: choose another name for the report.").format(place))
        layers.copy([given], place, context, feedback)
        if self._is_kept:
            feedback.pushInfo(tr("The displayed content of {} is saved beside the report: {}").format(given.name, place))
        return place


def sentences(errors):
    """Returns the errors and warnings that GDAL and meshmark printed, without prefixes."""
    found, warned, other = [], [], []
    for line in filter(None, map(str.strip, errors.splitlines())):
        kind, _, rest = line.partition(": ")
        if kind.startswith("Warning "):
            warned.append(rest)
        elif (kind.startswith("ERROR ") and not rest.startswith(CONSEQUENCE)) or kind == "meshmark":
            found.append(rest)
        else:
            other.append(line)
    # The other messages only repeat the failure when a reason is known.
    return found or other, warned
