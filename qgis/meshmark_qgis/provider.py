"""The Processing provider."""

from qgis.core import QgsProcessingProvider
from qgis.PyQt.QtGui import QIcon

from .algorithm import ICON
from .compare import Compare
from .export import Export
from .text import tr
from .verify import Verify


class MeshmarkProvider(QgsProcessingProvider):
    def id(self):
        return "meshmark"

    def name(self):
        return "meshmark"

    def longName(self):
        return tr("meshmark: watermarks of vector maps")

    def icon(self):
        return QIcon(ICON)

    def svgIconPath(self):
        return ICON

    def loadAlgorithms(self):
        for algorithm in (Export, Verify, Compare):
            self.addAlgorithm(algorithm())
