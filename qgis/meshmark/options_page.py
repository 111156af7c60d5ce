"""The page of Settings > Options."""

from qgis.gui import QgsFileWidget, QgsOptionsPageWidget, QgsOptionsWidgetFactory
from qgis.PyQt.QtGui import QIcon
from qgis.PyQt.QtWidgets import QFormLayout, QLabel

from . import settings
from .algorithm import ICON
from .text import tr


def rows():
    """Setting, label, what is chosen, and what holds while it is empty."""
    file, folder = QgsFileWidget.StorageMode.GetFile, QgsFileWidget.StorageMode.GetDirectory
    return [
        (settings.COMMAND, tr("Command meshmark"), file, tr("the one on the path")),
        (
            settings.DRIVER_FOLDER,
            tr("Folder of the GDAL driver (ogr_MESHMARK.so)"),
            folder,
            tr("GDAL's plugin folder"),
        ),
        (settings.KEY_FILE, tr("Key file, as the default of the dialogs"), file, tr("none")),
        (settings.RECORD_FOLDER, tr("Record folder, as the default of the dialogs"), folder, tr("none")),
    ]


class OptionsPage(QgsOptionsPageWidget):
    def __init__(self, parent, changed):
        super().__init__(parent)
        self._changed = changed
        self._widgets = {}
        layout = QFormLayout(self)
        for name, label, mode, otherwise in rows():
            widget = QgsFileWidget(self)
            widget.setStorageMode(mode)
            widget.setFilePath(settings.get(name))
            widget.lineEdit().setPlaceholderText(otherwise)
            layout.addRow(label, widget)
            self._widgets[name] = widget
        note = QLabel(
            tr("The paths of the command and of the driver are only needed where they are not found by themselves.")
        )
        note.setWordWrap(True)
        layout.addRow(note)

    def apply(self):
        for name, widget in self._widgets.items():
            settings.put(name, widget.filePath())
        self._changed()


class OptionsFactory(QgsOptionsWidgetFactory):
    """`changed` is called when settings were saved."""

    def __init__(self, changed):
        super().__init__("meshmark", QIcon(ICON))
        self._changed = changed

    def icon(self):
        return QIcon(ICON)

    def createWidget(self, parent):
        return OptionsPage(parent, self._changed)
