"""Runs the plugin's algorithms on layers that are no plain files, and cancels runs; qgis_plugin.sh
verifies the copies."""

import json
import os
import subprocess
import sys
import threading
from unittest import mock

sys.path[:0] = ["/usr/share/qgis/python/plugins", sys.argv[1]]

import folder
from meshmark_qgis import commands
from meshmark_qgis.provider import MeshmarkProvider
from osgeo import gdal
from processing.core.Processing import Processing
from qgis.core import (
    QgsApplication,
    QgsFeature,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeedback,
    QgsProcessingModelAlgorithm,
    QgsProcessingModelChildAlgorithm,
    QgsProcessingModelChildParameterSource,
    QgsProcessingModelOutput,
    QgsProject,
    QgsRasterLayer,
    QgsSettings,
    QgsVectorLayer,
)

HERE = os.getcwd()


def of_map(table, file="map.gpkg"):
    layer = QgsVectorLayer(f"{HERE}/{file}|layername={table}", table, "ogr")
    assert layer.isValid()
    return layer


def export(name, layers, feedback=None, **options):
    import processing

    return processing.run(
        "meshmark:export",
        {
            "LAYERS": layers,
            "RECIPIENT": "ACME GmbH",
            "KEY": f"{HERE}/key.json",
            "RECORDS": f"{HERE}/records",
            "OUTPUT": f"{HERE}/{name}.gpkg",
            **options,
        },
        feedback=feedback,
    )


def fails(why, name, layers, feedback=None, **options):
    with folder.unchanged(f"qgis_plugin: {why}"):
        try:
            export(name, layers, feedback, **options)
        except QgsProcessingException as error:
            assert why in str(error), error
        else:
            raise AssertionError(f"no error with {why}")


class Cancelling(QgsProcessingFeedback):
    """Cancels when the algorithm logs a message, or slightly later."""

    def __init__(self, text, seconds):
        super().__init__(False)
        self._text, self._seconds = text, seconds

    def setProgressText(self, text):
        if text == self._text:
            threading.Timer(self._seconds, self.cancel).start()


def memory_layer():
    """Returns a copy in memory with one unsaved edit: a feature less."""
    source = of_map("buildings")
    layer = QgsVectorLayer(f"Polygon?crs={source.crs().authid()}", "in memory", "memory")
    layer.dataProvider().addAttributes([f for f in source.fields() if f.name() != "fid"])
    layer.updateFields()
    copies = list(source.getFeatures())
    for feature in copies:
        feature.setAttributes(feature.attributes()[1:])
    layer.dataProvider().addFeatures(copies)
    layer.startEditing()
    layer.deleteFeature(next(layer.getFeatures()).id())
    return layer


def layer_with_text_as_fid():
    layer = QgsVectorLayer("Polygon?crs=EPSG:3067&field=fid:string", "text", "memory")
    feature = QgsFeature(layer.fields())
    feature.setAttributes(["first"])
    layer.dataProvider().addFeatures([feature])
    return layer


def count(path):
    layer = QgsVectorLayer(path, "", "ogr")
    return layer.featureCount()


def export_layers():
    memory = memory_layer()
    export("memory", [memory])
    assert count(f"{HERE}/memory.gpkg") == memory.featureCount() == of_map("buildings").featureCount() - 1
    filtered = of_map("buildings")
    assert filtered.setSubsetString("fid % 10 <> 0")
    export("filtered", [filtered])
    assert 0 < count(f"{HERE}/filtered.gpkg") == filtered.featureCount() < of_map("buildings").featureCount()
    QgsSettings().setValue("meshmark/driver_folder", f"{HERE}/records")
    # A folder without a driver in the settings does no harm where the driver is installed.
    export("degrees", [QgsVectorLayer(f"{HERE}/europe.gpkg", "first layer", "ogr")])
    QgsSettings().remove("meshmark/driver_folder")
    written = export("joined", [of_map("roads"), of_map("buildings"), of_map("roads")])
    assert [path.partition("|layername=")[2] for path in written["MARKED_LAYERS"]] == ["roads", "buildings", "roads 2"]


def verify_what_a_layer_shows():
    import processing

    suspect = of_map("buildings", "filtered.gpkg")
    assert suspect.setSubsetString("fid % 2 = 0")
    found = processing.run(
        "meshmark:verify",
        {
            "REFERENCE": f"{HERE}/records/filtered.reference.gpkg",
            "SUSPECT": suspect,
            "KEY": f"{HERE}/key.json",
            "RECORD": f"{HERE}/records/filtered.json",
            "REPORT": f"{HERE}/half.html",
            "OPEN_REPORT": False,
        },
    )
    assert count(f"{HERE}/half.suspect.gpkg") == suspect.featureCount() > 0, "the report names a file that is gone"
    with open(f"{HERE}/half.html", encoding="utf-8") as page:
        assert f"{HERE}/half.suspect.gpkg" in page.read()
    assert found["VERDICT"] == "match" and found["RECIPIENT"] == "ACME GmbH", found
    print("passed: qgis_plugin: the half of a map that a layer shows verifies", flush=True)


def verify_again():
    """The second run of a session gives equally good layers; without a match nobody is named."""
    import processing

    for run, (suspect, verdict, recipient) in enumerate(
        [("filtered.gpkg", "match", "ACME GmbH"), ("records/filtered.reference.gpkg", "no-match", "")]
    ):
        context = QgsProcessingContext()
        context.setProject(QgsProject.instance())
        given = {"REFERENCE": f"{HERE}/records/filtered.reference.gpkg", "SUSPECT": f"{HERE}/{suspect}"}
        places = {"KEY": f"{HERE}/key.json", "RECORDS": f"{HERE}/records", "EVIDENCE_MAP": f"{HERE}/evidence{run}.gpkg"}
        found = processing.run("meshmark:verify", {**given, **places}, context=context)
        assert (found["VERDICT"], found["RECIPIENT"]) == (verdict, recipient), found
        assert len(context.layersToLoadOnCompletion()) == 2, run
    print("passed: qgis_plugin: verified twice in one session", flush=True)


def no_layers():
    """An unreadable layer does not count as empty, and a raster causes no traceback."""
    gdal.GetDriverByName("GTiff").Create(f"{HERE}/raster.tif", 4, 4)
    broken = QgsVectorLayer("url='http://127.0.0.1:9/' typename='x'", "broken", "WFS")
    for layer, why in [
        (broken, "The layer broken cannot be read"),
        (QgsRasterLayer(f"{HERE}/raster.tif", "raster"), "raster is no vector layer"),
    ]:
        feedback = QgsProcessingFeedback(False)
        with folder.unchanged(f"qgis_plugin: {why}"):
            try:
                export("other", [of_map("buildings"), layer], feedback)
            except QgsProcessingException:
                assert why in feedback.textLog() and "Traceback" not in feedback.textLog(), feedback.textLog()
            else:
                raise AssertionError(f"no error with {why}")


def verification_fails(what, why, evidence, report, feedback=None):
    """A filtered layer is a suspect: the temporary copy of its features is removed, too."""
    import processing

    suspect = of_map("buildings", "filtered.gpkg")
    assert suspect.setSubsetString("fid % 2 = 0")
    given = {"REFERENCE": f"{HERE}/records/filtered.reference.gpkg", "SUSPECT": suspect}
    places = {"KEY": f"{HERE}/key.json", "RECORD": f"{HERE}/records/filtered.json"}
    files = {"EVIDENCE_MAP": f"{HERE}/{evidence}", "REPORT": f"{HERE}/{report}"}
    with folder.unchanged(f"qgis_plugin: {what}"):
        try:
            processing.run("meshmark:verify", {**given, **places, **files}, feedback=feedback)
        except QgsProcessingException as error:
            assert why in str(error), error
        else:
            raise AssertionError(f"no error with {why}")


def both_files_or_none():
    """The report cannot be written once the evidence map has its name."""
    taken_back = "a report that fails takes the evidence map back"
    verification_fails(taken_back, "one.html cannot be written", "one.html", "one.html")
    cancelling = Cancelling("Verifying", 0.2)
    verification_fails("a verification that is cancelled", "Cancelled", "new.gpkg", "new.html", cancelling)


def no_command(name, content):
    """A program in the settings that is not meshmark causes one sentence, too."""
    import processing

    path = f"{HERE}/{name}"
    with open(path, "wb") as file:
        file.write(content)
    os.chmod(path, 0o755)
    QgsSettings().setValue("meshmark/command", path)
    maps = [f"{HERE}/records/filtered.reference.gpkg", f"{HERE}/filtered.gpkg"]
    try:
        processing.run("meshmark:compare", dict(zip(["ORIGINAL", "MARKED"], maps)))
    except QgsProcessingException as error:
        assert "Settings > Options > meshmark" in str(error) and "Traceback" not in str(error), error
    else:
        raise AssertionError(f"{name} is not refused")
    finally:
        QgsSettings().remove("meshmark/command")


def impostor(name, *lines):
    """Makes a program in place of ogr2ogr that ends with exit code 0."""
    path = f"{HERE}/{name}.sh"
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(["#!/bin/sh", *lines, "exit 0", ""]))
    os.chmod(path, 0o755)
    return mock.patch.object(commands, "ogr2ogr", lambda: path)


def older_file_is_no_copy():
    """The run fails if ogr2ogr ends with exit code 0 and the copy is for another recipient."""
    buildings = of_map("buildings")
    export("older", [buildings])
    for_b = {"RECIPIENT": "B", "OUTPUT": f"{HERE}/older.gpkg"}
    fails("exists: choose another file", "older", [buildings], **for_b)
    fails("older.gpkg is the older file", "older", [buildings], **for_b, OVERWRITE=True, PATCH_SIZE=4096)
    no_copy = "No copy for B was made"
    record_of_a = f"cp '{HERE}/records/older.json' '{HERE}/records/other.json'"
    with impostor("idle"):
        fails(no_copy, "older", [buildings], **for_b, OVERWRITE=True)
        fails(no_copy, "other", [buildings], RECIPIENT="B")
    others = f"cp '{HERE}/older.gpkg' '{HERE}/other.gpkg'; touch '{HERE}/records/other.reference.gpkg'"
    for name, lines in [("unrecorded", [others]), ("of_another", [others, record_of_a])]:
        with impostor(name, *lines):
            try:
                export("other", [buildings], RECIPIENT="B")
            except QgsProcessingException as error:
                assert no_copy in str(error), error
            else:
                raise AssertionError(f"{name}: what another run wrote is taken for the copy")
        for left in ("other.gpkg", "records/other.json", "records/other.reference.gpkg"):
            if os.path.exists(left):
                os.remove(left)
    by_message = export("by_message", [buildings], RECIPIENT=None, MESSAGE="00112233445566778899AABBCCDDEEFF")
    assert os.path.exists(by_message["RECORD"])
    print("passed: qgis_plugin: what this run did not make is no copy", flush=True)


def figures_are_per_cent():
    import processing

    maps = {"ORIGINAL": f"{HERE}/records/older.reference.gpkg", "MARKED": f"{HERE}/older.gpkg"}
    feedback = QgsProcessingFeedback(False)
    found = processing.run("meshmark:compare", {**maps, "REPORT": None}, feedback=feedback)
    command = [commands.meshmark(), "compare", "--json", *maps.values()]
    shares = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
    kept = found["RIGHT_ANGLES_KEPT_PERCENT"]
    assert abs(kept - 100 * shares["angles"]["right_angles_kept"]) < 1e-9 and kept > 1, kept
    assert abs(found["AREA_MAX_CHANGE_PERCENT"] - 100 * shares["areas"]["max_change"]) < 1e-9, found
    assert f"Right angles kept within 1 degree: {kept:.3g} %" in feedback.textLog(), feedback.textLog()
    print("passed: qgis_plugin: shares are given as per cent", flush=True)


def model(has_output, recipient="ACME GmbH"):
    """Exports a map, then verifies it."""

    def child(name, values):
        algorithm = QgsProcessingModelChildAlgorithm(f"meshmark:{name}")
        algorithm.setChildId(name)
        for parameter, value in values.items():
            algorithm.addParameterSources(parameter, [value])
        return algorithm

    value = QgsProcessingModelChildParameterSource.fromStaticValue
    output = QgsProcessingModelChildParameterSource.fromChildOutput
    places = {"KEY": value(f"{HERE}/key.json"), "RECORDS": value(f"{HERE}/records")}
    subject = {"RECIPIENT": value(recipient)}
    maps = {"REFERENCE": output("export", "REFERENCE"), "SUSPECT": output("export", "OUTPUT")}
    made = QgsProcessingModelAlgorithm("mark and verify")
    layers = value([f"{HERE}/map.gpkg|layername=buildings"])
    exporting = child("export", {"LAYERS": layers, **subject, **places})
    if has_output:
        marked = QgsProcessingModelOutput("marked")
        marked.setChildId("export")
        marked.setChildOutputName("OUTPUT")
        exporting.setModelOutputs({"marked": marked})
    made.addChildAlgorithm(exporting)
    made.addChildAlgorithm(child("verify", {**maps, "RECORD": output("export", "RECORD"), **places}))
    return made


def run_in_a_model():
    ok, log = run_model(f"{HERE}/model.gpkg")
    assert ok and "MATCH: " in log, log
    print("passed: qgis_plugin: a model marks and verifies", flush=True)
    for output, why in [(f"{HERE}/model.gpkg", "exists: choose another file"), (None, "No file to hand out is named")]:
        with folder.unchanged(f"qgis_plugin: a model stops: {why}"):
            ok, log = run_model(output)
            assert not ok and why in log and "Verifying" not in log, log
    ok, log = run_model(f"{HERE}/new.gpkg", recipient="")
    assert not ok and "No recipient is given" in log and "Verifying" not in log, log


def run_model(output, **subject):
    """Returns success and log. QGIS makes a temporary file of an output that the model lacks."""
    context, feedback = QgsProcessingContext(), QgsProcessingFeedback(False)
    made = model(output is not None, **subject)
    made.initAlgorithm()
    _, ok = made.run({"export:marked": output} if output else {}, context, feedback)
    return ok, feedback.textLog()


def fail_without_a_trace():
    buildings = of_map("buildings")
    copying, marking = Cancelling("Copying the layers", 0), Cancelling("Marking", 0.3)
    fails("Cancelled: nothing was written", "cancelled", [buildings], copying)
    fails("Cancelled: nothing was written", "cancelled", [buildings], marking)
    fails("rename the field", "other", [layer_with_text_as_fid()])
    fails("write a GPKG and convert it", "other", [buildings], OUTPUT=f"{HERE}/other.gml")
    fails("Incorrect parameter value for AMPLITUDE", "wrong", [buildings], AMPLITUDE=1e9)
    fails("exists: choose another file", "memory", [buildings])
    fails("does not exist: make it", "none/other", [buildings])
    fails("is the file of the layer buildings itself", "map", [buildings], OVERWRITE=True)
    fails("No file to hand out is named", "other", [buildings], OUTPUT="TEMPORARY_OUTPUT")
    fails("No recipient is given", "other", [buildings], RECIPIENT=" ")
    both_files_or_none()
    no_layers()
    no_command("of_another_machine", b"\x7fELF of another machine")
    no_command("silent", b"#!/bin/sh\n")
    no_command("another_json", b"#!/bin/sh\necho '{}'\n")


application = QgsApplication([], False)
application.initQgis()
Processing.initialize()
provider = MeshmarkProvider()
assert QgsApplication.processingRegistry().addProvider(provider)
os.mkdir("records")
export_layers()
verify_what_a_layer_shows()
verify_again()
run_in_a_model()
older_file_is_no_copy()
figures_are_per_cent()
fail_without_a_trace()
