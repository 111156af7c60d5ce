"""Uses the plugin's dialogs as a user does: refusals, mouse wheel, buttons."""

import os
import sys
from unittest import mock

sys.path[:0] = ["/usr/share/qgis/python/plugins", sys.argv[1]]

import folder
from meshmark_qgis import keys
from meshmark_qgis.provider import MeshmarkProvider
from processing.core.Processing import Processing
from processing.gui import AlgorithmDialog as qgis_dialog
from qgis.core import QgsApplication, QgsProcessingParameterDefinition, QgsProject, QgsSettings, QgsVectorLayer
from qgis.PyQt.QtCore import QPoint, QPointF, Qt
from qgis.PyQt.QtGui import QWheelEvent
from qgis.PyQt.QtWidgets import QAbstractSpinBox, QComboBox, QPushButton, QScrollArea, QToolButton, QWidget

HERE = os.getcwd()
ADVANCED = QgsProcessingParameterDefinition.Flag.FlagAdvanced


def open_dialog(name, width=980):
    algorithm = QgsApplication.processingRegistry().createAlgorithmById(f"meshmark:{name}")
    dialog = algorithm.createCustomParametersWidget(None) or qgis_dialog.AlgorithmDialog(algorithm)
    # QGIS restores the size of the last dialog.
    dialog.show()
    dialog.resize(width, 700)
    QgsApplication.processEvents()
    return dialog


def open_advanced(dialog):
    for group in dialog.mainWidget().findChildren(QWidget, "grpAdvanced"):
        group.setProperty("collapsed", False)
    QgsApplication.processEvents()


def widget_of(dialog, name):
    return dialog.mainWidget().wrappers[name].wrappedWidget()


def refusal(given):
    """Returns the warning of the export dialog when it is run with these values."""
    dialog = open_dialog("export")
    dialog.setParameters({"LAYERS": [f"{HERE}/map.gpkg"], "KEY": f"{HERE}/key.json", "RECORDS": HERE, **given})
    with mock.patch.object(qgis_dialog.QMessageBox, "warning") as warning:
        dialog.runAlgorithm()
    dialog.close()
    assert warning.call_count == 1, "the run began"
    return warning.call_args[0][2]


def missing_values_are_reported():
    output = {"OUTPUT": f"{HERE}/new.gpkg"}
    with folder.unchanged("qgis_dialogs: no recipient, or no file"):
        assert "No recipient is given" in refusal(output)
        assert "No recipient is given" in refusal({**output, "RECIPIENT": " "})
        assert "not both" in refusal({**output, "RECIPIENT": "A", "MESSAGE": "0011223344556677"})
        for message in (refusal({"RECIPIENT": "A"}), refusal({"RECIPIENT": "A", "OUTPUT": "TEMPORARY_OUTPUT"})):
            assert "No file to hand out is named" in message, message


def is_in_order():
    dialog = open_dialog("export")
    shown = [p.name() for p in dialog.algorithm().parameterDefinitions() if not p.flags() & ADVANCED]
    assert shown == ["LAYERS", "RECIPIENT", "OUTPUT", "KEY", "RECORDS"], shown
    heights = [widget_of(dialog, name).mapTo(dialog, QPoint(0, 0)).y() for name in shown]
    assert heights == sorted(set(heights)), dict(zip(shown, heights))
    entry = widget_of(dialog, "OUTPUT")
    button = entry.findChild(QToolButton)
    button.menu().aboutToShow.emit()
    assert len(button.menu().actions()) == 1, [action.text() for action in button.menu().actions()]
    dialog.close()
    print("passed: qgis_dialogs: recipient, file, key and records come first", flush=True)


def turn_wheel(over):
    """Returns whether the box handles the event; otherwise the panel scrolls."""
    middle = QPointF(over.rect().center())
    place = over.mapToGlobal(over.rect().center())
    event = QWheelEvent(
        middle, QPointF(place), QPoint(0, 0), QPoint(0, -120),
        Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QgsApplication.sendEvent(over, event)
    return event.isAccepted()


def wheel_changes_nothing():
    for name in ("export", "verify", "compare"):
        dialog = open_dialog(name)
        open_advanced(dialog)
        panel = dialog.mainWidget()
        boxes = [box for kind in (QComboBox, QAbstractSpinBox) for box in panel.findChildren(kind) if box.isVisible()]
        assert boxes, name
        for box in boxes:
            box.setFocus()
            before = texts(boxes)
            assert not turn_wheel(box), f"{name}: {box} keeps the wheel from the panel"
            assert texts(boxes) == before, f"{name}: the wheel changed {box}"
        dialog.close()
    print("passed: qgis_dialogs: the wheel changes no value", flush=True)


def texts(boxes):
    return [box.currentText() if isinstance(box, QComboBox) else box.text() for box in boxes]


def buttons_are_in_reach():
    """Buttons are visible, also beside layers with long names and in a narrow dialog."""
    for name in ("export", "verify", "compare"):
        dialog = open_dialog(name, width=560)
        open_advanced(dialog)
        area = dialog.mainWidget().findChild(QScrollArea)
        right = area.viewport().mapToGlobal(area.viewport().rect().bottomRight()).x()
        buttons = [b for kind in (QToolButton, QPushButton) for b in area.findChildren(kind) if b.isVisible()]
        assert buttons, name
        for button in buttons:
            end = button.mapToGlobal(button.rect().bottomRight()).x()
            assert end <= right, f"{name}: {button.text() or button.objectName()} ends at {end}, the view at {right}"
        dialog.close()
    print("passed: qgis_dialogs: no button is pushed out", flush=True)


def no_map_is_compared_with_itself():
    for name, original, other in [("verify", "REFERENCE", "SUSPECT"), ("compare", "ORIGINAL", "MARKED")]:
        dialog = open_dialog(name)
        wrappers = dialog.mainWidget().wrappers
        assert not wrappers[original].parameterValue(), f"{name}: {original} is preset"
        assert wrappers[other].parameterValue(), f"{name}: {other} offers no layer"
        QgsProject.instance().addMapLayer(layer("added later"))
        assert not wrappers[original].parameterValue(), f"{name}: {original} is set by a layer that is added"
        with mock.patch.object(qgis_dialog.AlgorithmDialog, "blockControlsWhileRunning") as begun:
            dialog.runAlgorithm()
        assert not begun.called and dialog.messageBar().currentItem(), f"{name} runs without {original}"
        dialog.setParameters({original: f"{HERE}/map.gpkg"})
        assert wrappers[original].parameterValue() == f"{HERE}/map.gpkg"
        dialog.close()
    print("passed: qgis_dialogs: verify and compare preset no map twice", flush=True)


def press_new_key(dialog, path):
    """Returns the message, and whether it is a warning."""
    buttons = [b for b in dialog.mainWidget().findChildren(QPushButton) if b.text() == "New key…"]
    assert len(buttons) == 1, buttons
    with mock.patch.object(keys, "QMessageBox") as box, mock.patch.object(keys, "QFileDialog") as files:
        files.getSaveFileName.return_value = (path, "")
        buttons[0].click()
    said = box.mock_calls
    assert len(said) <= 1, said
    return (said[0][0], said[0][1][2]) if said else ("", "")


def key_is_made_once():
    dialog = open_dialog("export")
    QgsSettings().remove("meshmark/key_file")
    kind, text = press_new_key(dialog, f"{HERE}/made")
    assert kind == "information" and "secret" in text, (kind, text)
    assert os.stat("made.json").st_mode & 0o777 == 0o600
    assert dialog.mainWidget().wrappers["KEY"].parameterValue() == f"{HERE}/made.json"
    assert QgsSettings().value("meshmark/key_file") == f"{HERE}/made.json"
    with folder.unchanged("qgis_dialogs: a key that exists"):
        kind, text = press_new_key(dialog, f"{HERE}/made.json")
        assert kind == "warning" and "never overwritten" in text, (kind, text)
    with folder.unchanged("qgis_dialogs: no file for a key"):
        assert press_new_key(dialog, "") == ("", "")
    QgsSettings().setValue("meshmark/command", f"{HERE}/key.json")
    kind, text = press_new_key(dialog, f"{HERE}/other.json")
    QgsSettings().remove("meshmark/command")
    assert kind == "warning" and "correct the path" in text and not os.path.exists("other.json"), (kind, text)
    dialog.close()


def layer(name):
    made = QgsVectorLayer(f"{HERE}/map.gpkg|layername=buildings", name, "ogr")
    assert made.isValid()
    return made


# The application has widgets, which a platform without a screen draws nowhere.
application = QgsApplication([], True)
application.initQgis()
Processing.initialize()
provider = MeshmarkProvider()
assert QgsApplication.processingRegistry().addProvider(provider)
QgsProject.instance().addMapLayers([layer("first"), layer("a layer with a very long name, " * 6)])
missing_values_are_reported()
is_in_order()
wheel_changes_nothing()
buttons_are_in_reach()
no_map_is_compared_with_itself()
key_is_made_once()
