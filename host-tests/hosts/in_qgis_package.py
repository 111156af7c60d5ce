"""Marks and verifies with the Python package in place of driver and command, and compares what both make;
qgis_without_driver.sh provides both."""

import itertools
import json
import os
import sys
import threading
from unittest import mock

sys.path[:0] = ["/usr/share/qgis/python/plugins", sys.argv[1]]

import folder
from meshmark_qgis import (
    engines,
    marking_by_driver,
    marking_by_package,
    publication,
    verification_by_command,
    verification_by_package,
)
from meshmark_qgis.provider import MeshmarkProvider
from osgeo import ogr
from processing.core.Processing import Processing
from qgis.core import (
    QgsApplication,
    QgsFeature,
    QgsGeometry,
    QgsProcessingException,
    QgsProcessingFeedback,
    QgsVectorLayer,
)

HERE = os.getcwd()


def of_map(table, file="map.gpkg"):
    layer = QgsVectorLayer(f"{HERE}/{file}|layername={table}", table, "ogr")
    assert layer.isValid()
    return layer


def by(engine):
    return mock.patch.object(engines, "marking", lambda: engine)


def export(engine, name, layers, feedback=None, **options):
    """Returns the log of a run, which writes into the folder of its engine."""
    import processing

    at = f"{HERE}/{'package' if engine is marking_by_package else 'driver'}"
    places = {"KEY": f"{HERE}/key.json", "RECORDS": f"{at}/records", "OUTPUT": f"{at}/{name}"}
    feedback = feedback or QgsProcessingFeedback(False)
    given = {"LAYERS": layers, "RECIPIENT": "ACME GmbH", "ADD_TO_PROJECT": False, **places, **options}
    with by(engine):
        processing.run("meshmark:export", given, feedback=feedback)
    return feedback.textLog()


def rows(path):
    """Returns for each layer its schema, and its features with every value and bit."""
    dataset = ogr.Open(path)
    found = {}
    for number in range(dataset.GetLayerCount()):
        layer = dataset.GetLayer(number)
        definition = layer.GetLayerDefn()
        fields = [definition.GetFieldDefn(i) for i in range(definition.GetFieldCount())]
        schema = [(f.GetName(), f.GetType(), f.GetSubType(), f.GetWidth(), f.GetPrecision()) for f in fields]
        srs = layer.GetSpatialRef()
        head = (schema, layer.GetGeomType(), layer.GetFIDColumn(), layer.GetGeometryColumn(), srs and srs.ExportToWkt())
        body = []
        for feature in layer:
            geometry = feature.GetGeometryRef()
            values = [
                feature.GetFieldAsString(i) if feature.IsFieldSetAndNotNull(i) else None for i in range(len(fields))
            ]
            body.append((feature.GetFID(), values, None if geometry is None else bytes(geometry.ExportToIsoWkb())))
        found[layer.GetName()] = (head, body)
    return found


def record_of(path):
    """Returns the text of a record without the digests of files, which hold the time."""
    with open(path, encoding="utf-8") as file:
        record = json.load(file)
    digests = [record[part].pop("file_sha256", None) for part in ("reference", "copy") if part in record]
    return json.dumps(record), [digest is not None for digest in digests]


def same_by_both(what, name, layers, **options):
    """The package makes the coordinates, attributes and record of the driver."""
    for engine in (marking_by_driver, marking_by_package):
        export(engine, name, layers, **options)
    stem = os.path.splitext(name)[0]
    assert rows(f"package/{name}") == rows(f"driver/{name}"), what
    ours, theirs = (record_of(f"{engine}/records/{stem}.json") for engine in ("package", "driver"))
    assert ours == theirs, f"{what}: {ours} {theirs}"
    files = [sorted(os.listdir(engine)) for engine in ("package", "driver")]
    assert files[0] == files[1], f"{what}: {files}"
    reference = [rows(f"{engine}/records/{stem}.reference.gpkg") for engine in ("package", "driver")]
    places = [{name: [row[2] for row in body] for name, (_, body) in found.items()} for found in reference]
    assert places[0] == places[1], what
    print(f"passed: qgis_package: {what}: coordinates, attributes and record of the driver", flush=True)


def odd_layer(has_curves=False):
    """Returns heights, measures, missing geometries and values of many types."""
    fields = "field=text:string&field=whole:long&field=real:double&field=day:date&field=time:datetime&field=yes:bool"
    kind = "MultiCurveZM" if has_curves else "MultiLineStringZM"
    layer = QgsVectorLayer(f"{kind}?crs=EPSG:3067&{fields}", "Gräben & Höhen", "memory")
    features = []
    for number in range(700):
        x, y = 500000 + 40 * (number % 25), 6700000 + 40 * (number // 25)
        feature = QgsFeature(layer.fields())
        feature.setAttributes(["Ä\n'\"" if number % 3 else None, number**3, number / 7, None, None, bool(number % 2)])
        line = f"({x} {y} 1.25 2,{x + 13} {y + 4 + number % 5} 3 4,{x + 21} {y + 17} 5 6)"
        kind, member = ("MULTICURVE", f"CIRCULARSTRING ZM {line}") if has_curves else ("MULTILINESTRING", line)
        if number % 90 != 7:
            feature.setGeometry(QgsGeometry.fromWkt(f"{kind} ZM ({member})"))
        features.append(feature)
    assert layer.dataProvider().addFeatures(features)[0]
    return layer


def results_are_those_of_the_driver():
    two = [of_map("roads"), of_map("buildings")]
    same_by_both("two layers in a GeoPackage", "two.gpkg", two)
    same_by_both("a Shapefile", "map.shp", [of_map("buildings")])
    same_by_both("FlatGeobuf", "map.fgb", [of_map("buildings")])
    same_by_both("GeoJSON", "map.geojson", [of_map("buildings")])
    same_by_both("degrees in GeoJSONSeq", "map.geojsonl", [of_map("buildings", "degrees.gpkg")])
    europe = QgsVectorLayer(f"{HERE}/europe.gpkg")
    same_by_both("a continent in GeoJSONSeq", "europe.geojsonl", [europe], AMPLITUDE=200, TOLERANCE=2000)
    same_by_both("options", "options.gpkg", two, SHAPE="FREE", PRECISION=0.01, AMPLITUDE=0.2, PART_SIZE=1920)
    same_by_both("a message", "message.gpkg", two, RECIPIENT=None, MESSAGE="00112233445566778899AABBCCDDEEFF")
    same_by_both("heights, measures, missing geometries", "odd.gpkg", [odd_layer()])
    same_by_both("a file that is replaced", "map.shp", [of_map("buildings")], OVERWRITE=True, RECIPIENT="B")


def verify(engine, name, **given):
    import processing

    maps = {"REFERENCE": f"{HERE}/driver/records/two.reference.gpkg", "SUSPECT": f"{HERE}/package/two.gpkg"}
    files = {"EVIDENCE_MAP": f"{HERE}/{name}.gpkg", "REPORT": f"{HERE}/{name}.html", "OPEN_REPORT": False}
    feedback = QgsProcessingFeedback(False)
    given = {**maps, "KEY": f"{HERE}/key.json", **files, **given}
    with mock.patch.object(engines, "verification", lambda: engine):
        found = processing.run("meshmark:verify", given, feedback=feedback)
    return {name: value for name, value in found.items() if name not in files}, feedback.textLog()


def verifications_are_those_of_the_command():
    record, records = {"RECORD": f"{HERE}/driver/records/two.json"}, {"RECORDS": f"{HERE}/package/records"}
    unmarked = {"SUSPECT": f"{HERE}/map.gpkg"}
    cases = [record, records, {**record, **unmarked}, {**records, **unmarked}, {**record, "EXACT_DISPLACEMENTS": True}]
    for number, case in enumerate(cases):
        by_command, _ = verify(verification_by_command, f"command{number}", **case)
        by_package, log = verify(verification_by_package, f"package{number}", **case)
        assert by_package == by_command, (by_package, by_command)
        assert rows(f"package{number}.gpkg") == rows(f"command{number}.gpkg"), case
        assert os.path.getsize(f"package{number}.html") > 10000
    assert by_package["RECIPIENT"] == "ACME GmbH"
    print("passed: qgis_package: verdicts and evidence maps are those of the command", flush=True)


def comparisons_are_those_of_the_command():
    import processing

    maps = {
        "ORIGINAL": f"{HERE}/driver/records/two.reference.gpkg",
        "MARKED": f"{HERE}/package/two.gpkg",
        "REPORT": None,
    }
    for layers in ("", "roads"):
        figures = []
        for engine in (verification_by_command, verification_by_package):
            with mock.patch.object(engines, "verification", lambda engine=engine: engine):
                figures.append(processing.run("meshmark:compare", {**maps, "LAYERS": layers}))
        assert figures[0] == figures[1] and figures[0]["FEATURES"] > 0, figures
    print("passed: qgis_package: comparisons are those of the command", flush=True)


class Cancelling(QgsProcessingFeedback):
    """Cancels some time after the algorithm logs a message."""

    def __init__(self, text, seconds):
        super().__init__(False)
        self._text, self._seconds = text, seconds

    def setProgressText(self, text):
        if text.startswith(self._text):
            threading.Timer(self._seconds, self.cancel).start()


def fails(why, name, layers, feedback=None, **options):
    with folder.unchanged(f"qgis_package: {why}"):
        try:
            export(marking_by_package, name, layers, feedback, **options)
        except QgsProcessingException as error:
            assert why in str(error), error
        else:
            raise AssertionError(f"no error with {why}")


def fail_without_a_trace():
    buildings = of_map("buildings")
    for text in ("Copying the layers", "Marking", "Writing", "Reading back"):
        fails("Cancelled: nothing was written", "new.gpkg", [buildings], Cancelling(text, 0))
    fails("Cancelled: nothing was written", "new.gpkg", [buildings], Cancelling("Marking", 0.3))
    fails("holds one layer", "new.shp", [buildings, of_map("roads")])
    fails("write a GPKG and convert it", "new.gml", [buildings])
    fails("another CRS", "new.geojsonl", [buildings])
    fails("has no option ATTRIBUTES=REFUSE", "new.gpkg", [buildings], ATTRIBUTES="REFUSE")
    fails("has no option BASE", "new.gpkg", [buildings], BASE=f"{HERE}/driver/records/two.json")
    fails("curved geometries", "new.gpkg", [odd_layer(has_curves=True)])
    fails("vertices", "new.gpkg", [buildings], PATCH_SIZE=4096)
    fails("wrong.json", "new.gpkg", [buildings], KEY=f"{HERE}/wrong.json")
    fails("none.json: No such file", "new.gpkg", [buildings], KEY=f"{HERE}/none.json")
    with open("package/key.json", "wb") as copy, open("key.json", "rb") as key:
        copy.write(key.read())
    fails("is the key file", "key.json", [buildings], KEY=f"{HERE}/package/key.json", OVERWRITE=True)
    with open("package/map.gpkg-wal", "w", encoding="utf-8") as file:
        file.write("of another program")
    fails("Another program writes to", "map.gpkg", [buildings])
    os.remove("package/map.gpkg-wal")
    places_that_are_taken()


def places_that_are_taken():
    """A file that appears while the map is marked is kept, and nothing else appears."""
    link = publication._link
    for taken in ("new.gpkg", "records/new.json", "records/new.reference.gpkg"):

        def appears(present, new, taken=taken):
            if new.endswith(taken):
                with open(new, "w", encoding="utf-8") as file:
                    file.write("of another program")
            link(present, new)

        with mock.patch.object(publication, "_link", appears):
            try:
                export(marking_by_package, "new.gpkg", [of_map("buildings")])
            except QgsProcessingException as error:
                assert "exists: move it away" in str(error), error
            else:
                raise AssertionError(f"{taken} was replaced")
        left = [
            path
            for path in ("new.gpkg", "records/new.json", "records/new.reference.gpkg")
            if os.path.exists(f"package/{path}")
        ]
        assert left == [taken], left
        os.remove(f"package/{taken}")
    print("passed: qgis_package: a place that is taken undoes everything", flush=True)


def what_is_not_read_back_is_not_published():
    """A writer of GDAL that fails silently, in three ways, makes no copy."""
    from meshmark_qgis import maps

    move = maps.move

    def unmoved(path, moved, feedback):
        pass

    def without_the_last(path, moved, feedback):
        move(path, moved, feedback)
        dataset = ogr.Open(path, 1)
        for name, layer in moved.items():
            dataset.GetLayerByName(name).DeleteFeature(layer.ids[-1])

    def elsewhere(path, moved, feedback):
        move(path, moved, feedback)
        dataset = ogr.Open(path, 1)
        table = dataset.GetLayer(0)
        feature = table.GetNextFeature()
        geometry = feature.GetGeometryRef().Clone()
        ring = geometry.GetGeometryRef(0)
        ring = ring.GetGeometryRef(0) if ring.GetGeometryCount() else ring
        ring.SetPoint_2D(1, ring.GetX(1) + 1e-9, ring.GetY(1))
        feature.SetGeometry(geometry)
        table.SetFeature(feature)

    for fault, why in [
        (unmoved, "other coordinates"),
        (without_the_last, "features were meant"),
        (elsewhere, "other coordinates"),
    ]:
        with mock.patch.object(maps, "move", fault):
            fails(why, "new.gpkg", [of_map("buildings")])
    with (
        mock.patch.object(marking_by_package.read_back, "check_places", lambda *_: None),
        mock.patch.object(maps, "move", unmoved),
    ):
        fails("cannot be read from the written file", "new.geojsonl", [of_map("buildings", "degrees.gpkg")])


def killed(step):
    """Kills a run before a step of its publication, as a crash of QGIS would; returns False where it ended before."""
    child = os.fork()
    if child == 0:
        steps = itertools.count()

        def dies(f):
            def call(*arguments):
                if next(steps) == step:
                    os._exit(9)
                f(*arguments)

            return call

        publication._link, os.replace = dies(publication._link), dies(os.replace)
        if step < 0:
            publication.publish = lambda *_: os._exit(9)
        records = f"{HERE}/package/records/killed"
        places = {"RECORD": f"{records}.json", "REFERENCE": f"{records}.reference.gpkg", "KEY": f"{HERE}/key.json"}
        options = {**places, "RECIPIENT": "A", "OVERWRITE": "YES"}
        source = f"{HERE}/driver/records/map.reference.gpkg"
        marking_by_package.export(source, f"{HERE}/package/map.shp", options, QgsProcessingFeedback(False))
        os._exit(0)
    _, status = os.waitpid(child, 0)
    return os.WEXITSTATUS(status) == 9


def the_remains_of_a_killed_run_go():
    """The next run to the same folder undoes what a killed one had begun; complete files stay."""
    before, step = folder.state(), -1
    while killed(step):
        assert folder.state() != before, step
        with publication.Workplaces(f"{HERE}/package"):
            pass
        after = folder.state()
        different = sorted(name for name in before.keys() | after.keys() if before.get(name, 0) != after.get(name, 0))
        assert not different, (step, different)
        step += 1
    # Record, reference, the parts of the Shapefile.
    assert step >= 5 and os.path.exists("package/records/killed.json"), step
    print("passed: qgis_package: what a killed run leaves is undone by the next", flush=True)


application = QgsApplication([], False)
application.initQgis()
Processing.initialize()
provider = MeshmarkProvider()
assert QgsApplication.processingRegistry().addProvider(provider)
for engine in ("driver", "package"):
    os.makedirs(f"{engine}/records")
results_are_those_of_the_driver()
verifications_are_those_of_the_command()
comparisons_are_those_of_the_command()
fail_without_a_trace()
what_is_not_read_back_is_not_published()
the_remains_of_a_killed_run_go()
