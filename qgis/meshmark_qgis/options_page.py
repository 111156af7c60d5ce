"""The page of Settings > Options."""

from qgis.gui import QgsFileWidget, QgsOptionsPageWidget, QgsOptionsWidgetFactory
from qgis.PyQt.QtGui import QIcon
from qgis.PyQt.QtWidgets import QFormLayout, QLabel

from . import settings
from .algorithm import ICON
from .text import tr


def rows():
    """Returns setting, label, kind of path, placeholder and purpose of each row."""
    file, folder = QgsFileWidget.StorageMode.GetFile, QgsFileWidget.StorageMode.GetDirectory
    default = tr("The default of the dialogs.")
    return [
        (settings.COMMAND, tr("Command"), file, tr("found on the path"), tr("The path of the program meshmark.")),
        (
            settings.DRIVER_FOLDER,
            tr("Driver folder"),
            folder,
            tr("GDAL's plugin folder"),
            tr("The folder of the GDAL driver (ogr_MESHMARK.so)."),
        ),
        (settings.KEY_FILE, tr("Key file"), file, tr("none"), default),
        (settings.RECORD_FOLDER, tr("Record folder"), folder, tr("none"), default),
    ]


class OptionsPage(QgsOptionsPageWidget):
    def __init__(self, parent, changed):
        super().__init__(parent)
        self._changed = changed
        self._widgets = {}
        layout = QFormLayout(self)
        for name, label, mode, otherwise, purpose in rows():
            widget = QgsFileWidget(self)
            widget.setStorageMode(mode)
            widget.setFilePath(settings.get(name))
            widget.lineEdit().setPlaceholderText(otherwise)
            widget.setToolTip(purpose)
            layout.addRow(label, widget)
            self._widgets[name] = widget
        note = QLabel(
            tr(
                "The paths of the command and of the driver are needed only if they are not found automatically."
                " Key file and record folder are the defaults of the dialogs."
            )
        )
        note.setWordWrap(True)
        layout.addRow(note)

    def apply(self):
        for name, widget in self._widgets.items():
            settings.put(name, widget.filePath())
        self._changed()


class OptionsFactory(QgsOptionsWidgetFactory):
    """Creates the page, which calls `changed` after it has saved the settings."""

    def __init__(self, changed):
        super().__init__("meshmark", QIcon(ICON))
        self._changed = changed

    def icon(self):
        return QIcon(ICON)

    def createWidget(self, parent):
        return OptionsPage(parent, self._changed)
