"""Runs in QGIS itself, by --code: marks through the context menu, verifies, and takes the pictures
of docs/qgis.md.

Environment: MESHMARK_WORK, a folder with map.gpkg, key.json and records/; MESHMARK_PICTURES, where to."""

import os
import sys
import time
import traceback

import processing
from osgeo import gdal
from processing.gui.AlgorithmDialog import AlgorithmDialog
from qgis.core import QgsApplication, QgsProject, QgsSettings
from qgis.PyQt.QtCore import QTimer
from qgis.PyQt.QtGui import QColor
from qgis.PyQt.QtWidgets import QApplication, QDockWidget, QToolBar, QToolButton
from qgis.utils import iface, reloadPlugin

WORK, PICTURES = os.environ["MESHMARK_WORK"], os.environ["MESHMARK_PICTURES"]
# Times within which a dialog opens and a run ends, seconds.
PATIENCE = 120


def wait_for(condition, what):
    until = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < until, f"waited in vain for {what}"
        QgsApplication.processEvents()
        time.sleep(0.02)


def settle(seconds=1.0):
    until = time.monotonic() + seconds
    wait_for(lambda: time.monotonic() > until, "nothing")


def picture(widget, name):
    settle()
    wait_for(lambda: not iface.mapCanvas().isDrawing(), "the map")
    assert widget.grab().save(os.path.join(PICTURES, name), "PNG", 0)


def tidy_window():
    window = iface.mainWindow()
    window.resize(1180, 740)
    for bar in window.findChildren(QToolBar):
        bar.hide()
    for dock in window.findChildren(QDockWidget):
        dock.setVisible(dock.objectName() == "Layers")
    window.statusBar().hide()
    iface.messageBar().clearWidgets()


def context_menu_entry():
    menu = iface.layerTreeView().menuProvider().createContextMenu()
    entries = [action for action in menu.actions() if action.text() == "Export with watermark…"]
    assert len(entries) == 1, [action.text() for action in menu.actions()]
    return entries[0]


def is_in_menu_and_toolbar():
    """Each entry exists once, also after the plugin is loaded again, and works."""
    assert reloadPlugin("meshmark_qgis")
    entries = ["Export with watermark…", "Verify suspect map…", "Compare original and marked map…", "New key…"]
    submenus = [a.menu() for a in iface.pluginMenu().actions() if a.menu() and a.text().replace("&", "") == "meshmark"]
    assert [[a.text() for a in menu.actions()] for menu in submenus] == [entries], submenus
    buttons = [b for b in iface.mainWindow().findChildren(QToolButton) if b.defaultAction() in submenus[0].actions()]
    assert [[a.text() for a in button.menu().actions()] for button in buttons] == [entries], buttons
    for action in submenus[0].actions()[:3]:
        action.trigger()
        wait_for(open_dialog, action.text())
        dialog = open_dialog()[0]
        assert dialog.algorithm().displayName() == action.text().rstrip("…"), action.text()
        dialog.close()


def open_dialog():
    return [w for w in QApplication.topLevelWidgets() if isinstance(w, AlgorithmDialog) and w.isVisible()]


def export_by_context_menu():
    layers = [iface.addVectorLayer(f"{WORK}/map.gpkg|layername={name}", name, "ogr") for name in ("buildings", "roads")]
    iface.layerTreeView().setCurrentLayer(layers[0])
    iface.layerTreeView().selectAll()
    context_menu_entry().trigger()
    wait_for(open_dialog, "the dialog")
    dialog = open_dialog()[0]
    parameters = dialog.createProcessingParameters()
    assert set(parameters["LAYERS"]) == {layer.source() for layer in layers}, parameters
    assert parameters["KEY"] == f"{WORK}/key.json", "the default is not that of the settings"
    assert parameters["AMPLITUDE"] == 0.1, parameters
    for_picture = {
        "RECIPIENT": "ACME GmbH",
        "KEY": "/maps/key.json",
        "RECORDS": "/maps/records",
        "OUTPUT": "/maps/acme.gpkg",
    }
    dialog.mainWidget().setParameters(for_picture)
    dialog.resize(980, 700)
    picture(dialog, "qgis-export.png")
    real = {name: parameters[name] for name in ("KEY", "RECORDS")}
    dialog.mainWidget().setParameters({**real, "OUTPUT": f"{WORK}/by_menu.gpkg"})
    dialog.runAlgorithm()
    wait_for(lambda: len(QgsProject.instance().mapLayers()) == 4, "the marked layers")
    names = {layer.name() for layer in QgsProject.instance().mapLayers().values()}
    assert {"buildings (marked)", "roads (marked)"} <= names, names
    dialog.close()


def leak(marked, suspect):
    """Returns the western half of a map."""
    dataset = gdal.OpenEx(marked)
    west, east, south, north = dataset.GetLayer(0).GetExtent()
    half = [west, south, (west + east) / 2, north]
    assert gdal.VectorTranslate(suspect, dataset, options=gdal.VectorTranslateOptions(format="GPKG", spatFilter=half))


def verify():
    QgsProject.instance().removeAllMapLayers()
    leak(f"{WORK}/by_menu.gpkg", f"{WORK}/suspect.gpkg")
    suspect = iface.addVectorLayer(f"{WORK}/suspect.gpkg|layername=buildings", "suspect", "ogr")
    suspect.renderer().symbol().setColor(QColor("#d9d4c8"))
    iface.layerTreeView().refreshLayerSymbology(suspect.id())
    results = processing.runAndLoadResults(
        "meshmark:verify",
        {
            "REFERENCE": f"{WORK}/records/by_menu.reference.gpkg",
            "SUSPECT": f"{WORK}/suspect.gpkg",
            "KEY": f"{WORK}/key.json",
            "RECORDS": f"{WORK}/records",
            "EVIDENCE_MAP": f"{WORK}/evidence.gpkg",
            "REPORT": f"{WORK}/report.html",
            "OPEN_REPORT": False,
        },
    )
    assert results["VERDICT"] == "match" and results["RECIPIENT"] == "ACME GmbH", results
    layers = {layer.name(): layer for layer in QgsProject.instance().mapLayers().values()}
    vertices, patches = layers["Matched vertices"], layers["Patches"]
    assert vertices.featureCount() == results["MATCHED_VERTICES"] > 100
    for layer in (vertices, patches):
        assert layer.renderer().type() == "RuleRenderer", layer.renderer().type()
    order = [layer.name() for layer in QgsProject.instance().layerTreeRoot().layerOrder()]
    assert order.index("Matched vertices") < order.index("Patches"), f"patches hide the vertices: {order}"
    iface.layerTreeView().expandAllNodes()
    iface.mapCanvas().setExtent(patches.extent().buffered(20))
    picture(iface.mainWindow(), "qgis-evidence.png")


def main():
    status = 1
    try:
        QgsSettings().setValue("meshmark/key_file", f"{WORK}/key.json")
        QgsSettings().setValue("meshmark/record_folder", f"{WORK}/records")
        is_in_menu_and_toolbar()
        tidy_window()
        export_by_context_menu()
        verify()
        status = 0
    except BaseException:
        traceback.print_exc()
    sys.stderr.flush()
    os._exit(status)


QTimer.singleShot(1000, main)
