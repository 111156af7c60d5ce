"""The dialog of the algorithms: that of QGIS, adapted to marking."""

from processing.gui.AlgorithmDialog import AlgorithmDialog
from processing.gui.ParametersPanel import ParametersPanel
from qgis.PyQt.QtCore import QEvent, QObject
from qgis.PyQt.QtWidgets import (
    QAbstractSpinBox,
    QComboBox,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QToolButton,
    QWidget,
)

from . import keys
from .text import tr


class Dialog(AlgorithmDialog):
    def getParametersPanel(self, alg, parent):  # noqa: N802, QGIS calls it so
        panel = ExportPanel if alg.name() == "export" else Panel
        return panel(parent, alg, self.in_place, self.active_layer)


class WheelScrolls(QObject):
    """Lets the wheel scroll the panel, so that it does not change the choice in a box."""

    def eventFilter(self, watched, event):  # noqa: N802, Qt calls it so
        if event.type() != QEvent.Type.Wheel:
            return False
        # An ignored event goes to the widget below.
        event.ignore()
        return True


class Panel(ParametersPanel):
    def initWidgets(self):  # noqa: N802, QGIS calls it so
        super().initWidgets()
        self._wheel = WheelScrolls(self)
        for kind in (QComboBox, QAbstractSpinBox):
            for box in self.findChildren(kind):
                box.installEventFilter(self._wheel)
        self._leave_first_layer_open()

    def _leave_first_layer_open(self):
        """Clears the preset of the original: QGIS would preset one layer for both maps."""
        maps = [p.name() for p in self.algorithm().parameterDefinitions() if p.type() == "vector"]
        for name in maps[:1]:
            # In Python this QgsMapLayerComboBox has the type of a plain one. The empty layer is the
            # first.
            box = self.wrappers[name].wrappedWidget().findChild(QComboBox)
            box.setProperty("allowEmptyLayer", True)
            box.setCurrentIndex(0)

    def addParameterLabel(self, parameter, label):  # noqa: N802, QGIS calls it so
        label.setWordWrap(True)
        super().addParameterLabel(parameter, label)


class ExportPanel(Panel):
    """Puts the recipient first and the file next, and adds a button for new keys."""

    def initWidgets(self):  # noqa: N802, QGIS calls it so
        super().initWidgets()
        output = self.wrappers["OUTPUT"].wrappedWidget()
        output.findChild(QLineEdit).setPlaceholderText(tr("[Name the file to hand out]"))
        menu = output.findChild(QToolButton).menu()
        menu.aboutToShow.connect(lambda: keep_last_action(menu))

    def addParameterLabel(self, parameter, label):  # noqa: N802, QGIS calls it so
        if parameter.name() == "RECIPIENT":
            # It is optional only beside a message.
            label.setText(parameter.description())
        super().addParameterLabel(parameter, label)

    def addParameterWidget(self, parameter, widget, stretch=0):  # noqa: N802, QGIS calls it so
        if parameter.name() == "KEY":
            widget = self._with_new_key(widget)
        super().addParameterWidget(parameter, widget, stretch)

    def addOutputLabel(self, label):  # noqa: N802, QGIS calls it so
        self._insert_below_recipient(label, 1)

    def addOutputWidget(self, widget, stretch=0):  # noqa: N802, QGIS calls it so
        self._insert_below_recipient(widget, 2)

    def _insert_below_recipient(self, widget, distance):
        recipient = self.wrappers["RECIPIENT"].wrappedWidget()
        # The form takes ownership of the widget only while Python holds the form.
        form = recipient.parentWidget()
        layout = form.layout()
        layout.insertWidget(layout.indexOf(recipient) + distance, widget)

    def _with_new_key(self, widget):
        row = QWidget()
        layout = QHBoxLayout(row)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(widget, 1)
        button = QPushButton(tr("New key…"))
        button.setToolTip(tr("Creates a secret key in a new file."))
        button.clicked.connect(self._new_key)
        layout.addWidget(button)
        return row

    def _new_key(self):
        path = keys.ask_and_make(self)
        if path:
            self.setParameters({"KEY": path})


def keep_last_action(menu):
    """Keeps "Save to File…" only, as a temporary file does not suit a file for a recipient."""
    for action in menu.actions()[:-1]:
        menu.removeAction(action)
