"""What QGIS starts and stops: the provider, the settings page, the entry in the context menu of layers."""

from qgis.core import QgsApplication, QgsMapLayer, QgsMapLayerType
from qgis.PyQt.QtGui import QIcon
from qgis.PyQt.QtWidgets import QAction

from .algorithm import ICON
from .provider import MeshmarkProvider
from .text import tr


class MeshmarkPlugin:
    def __init__(self, iface):
        self.iface = iface
        self.provider = None
        self.factory = None
        self.action = None
        self.dialog = None

    def initProcessing(self):
        """All that `qgis_process` needs."""
        self.provider = MeshmarkProvider()
        QgsApplication.processingRegistry().addProvider(self.provider)

    def initGui(self):
        from .options_page import OptionsFactory

        self.initProcessing()
        self.factory = OptionsFactory(self.provider.refreshAlgorithms)
        self.iface.registerOptionsWidgetFactory(self.factory)
        self.action = QAction(QIcon(ICON), tr("Export with watermark…"), self.iface.mainWindow())
        self.action.triggered.connect(self.export_layers)
        self.iface.addCustomActionForLayerType(self.action, "", QgsMapLayerType.VectorLayer, True)

    def unload(self):
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
        if self.factory is not None:
            self.iface.unregisterOptionsWidgetFactory(self.factory)
        if self.action is not None:
            self.iface.removeCustomActionForLayerType(self.action)

    def export_layers(self):
        """Opens the dialog of the algorithm with the layers that are selected in the layer tree."""
        import processing

        selected = self.iface.layerTreeView().selectedLayers() or [self.iface.activeLayer()]
        ids = [
            layer.id()
            for layer in selected
            if isinstance(layer, QgsMapLayer) and layer.type() == QgsMapLayerType.VectorLayer
        ]
        ready, missing = QgsApplication.processingRegistry().algorithmById("meshmark:export").canExecute()
        if not ready:
            self.iface.messageBar().pushCritical("meshmark", missing)
            return
        self.dialog = processing.createAlgorithmDialog("meshmark:export", {"LAYERS": ids})
        self.dialog.show()
