"""The plugin that QGIS starts and stops: provider, settings page, menu and toolbar entries."""

from qgis.core import QgsApplication, QgsMapLayer, QgsMapLayerType
from qgis.PyQt.QtGui import QIcon
from qgis.PyQt.QtWidgets import QAction, QMenu, QToolButton

from .algorithm import ICON
from .provider import MeshmarkProvider
from .text import tr

# The submenu of Plugins.
MENU = "meshmark"


class MeshmarkPlugin:
    def __init__(self, iface):
        self.iface = iface
        self.provider = None
        self.factory = None
        self.actions = []
        self.tool = None
        self.dialog = None

    def initProcessing(self):
        """Registers the provider, which suffices for `qgis_process`."""
        self.provider = MeshmarkProvider()
        QgsApplication.processingRegistry().addProvider(self.provider)

    def initGui(self):
        from .options_page import OptionsFactory

        self.initProcessing()
        self.factory = OptionsFactory(self.provider.refreshAlgorithms)
        self.iface.registerOptionsWidgetFactory(self.factory)
        export = self._action(tr("Export with watermark…"), self.export_layers)
        self.actions = [
            export,
            self._action(tr("Verify suspect map…"), lambda: self._open_dialog("verify")),
            self._action(tr("Compare original and marked map…"), lambda: self._open_dialog("compare")),
            self._action(tr("New key…"), self.make_key),
        ]
        for action in self.actions:
            self.iface.addPluginToMenu(MENU, action)
        self.tool = self.iface.addToolBarWidget(self._button(export))
        self.iface.addCustomActionForLayerType(export, "", QgsMapLayerType.VectorLayer, True)

    def _action(self, text, run):
        action = QAction(QIcon(ICON), text, self.iface.mainWindow())
        action.triggered.connect(lambda _checked: run())
        return action

    def _button(self, first):
        """Returns a button for the first action, with all actions in its menu."""
        button = QToolButton()
        button.setPopupMode(QToolButton.ToolButtonPopupMode.MenuButtonPopup)
        menu = QMenu(button)
        menu.addActions(self.actions)
        button.setMenu(menu)
        button.setDefaultAction(first)
        return button

    def unload(self):
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
        if self.factory is not None:
            self.iface.unregisterOptionsWidgetFactory(self.factory)
        if self.actions:
            self.iface.removeCustomActionForLayerType(self.actions[0])
            self.iface.removeToolBarIcon(self.tool)
        for action in self.actions:
            self.iface.removePluginMenu(MENU, action)

    def export_layers(self):
        """Opens the dialog of the algorithm with the layers that are selected in the layer tree."""
        selected = self.iface.layerTreeView().selectedLayers() or [self.iface.activeLayer()]
        ids = [
            layer.id()
            for layer in selected
            if isinstance(layer, QgsMapLayer) and layer.type() == QgsMapLayerType.VectorLayer
        ]
        self._open_dialog("export", {"LAYERS": ids})

    def make_key(self):
        from . import keys

        keys.ask_and_make(self.iface.mainWindow())

    def _open_dialog(self, name, given=None):
        """Opens the dialog of an algorithm, or reports what is missing."""
        import processing

        ready, missing = QgsApplication.processingRegistry().algorithmById(f"meshmark:{name}").canExecute()
        if not ready:
            self.iface.messageBar().pushCritical("meshmark", missing)
            return
        self.dialog = processing.createAlgorithmDialog(f"meshmark:{name}", given or {})
        self.dialog.show()
