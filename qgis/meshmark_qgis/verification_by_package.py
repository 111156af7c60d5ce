"""Verification, comparison and new keys with the Python package meshmark."""

import csv
import os
import tempfile

from osgeo import ogr
from qgis.core import QgsProcessingException

from . import files, maps, package
from .commands import Cancelled
from .text import tr

# The layers of an evidence map with the types of their geometries, and its fields with theirs.
LAYERS = {"matched_vertices": ogr.wkbPoint, "vertex_displacements": ogr.wkbLineString, "patches": ogr.wkbPolygon}
WHOLE, REAL = ogr.OFTInteger, ogr.OFTReal
FIELDS = {name: WHOLE for name in ("patch", "vertices", "found")}
FIELDS |= {name: REAL for name in ("score", "weight", "dx_m", "dy_m", "moved_m")} | {"recipient": ogr.OFTString}


def find():
    """Raises Missing unless the package is installed."""
    package.find()


def writes_report(_subcommand):
    """Returns that the package makes reports."""
    return True


def verify(request, feedback):
    """Returns the report as data; writes report and evidence map."""
    for path in filter(None, (request.report, request.evidence)):
        files.check_is_free(path)
    with package.reported(feedback) as meshmark:
        key = meshmark.Key.read(request.key)
        reference = maps.read(meshmark, request.reference, feedback)
        suspect = maps.read(meshmark, request.suspect, feedback)
        if request.record:
            marks = {"record": meshmark.Record.read(request.record)}
        else:
            marks = {"records": _records(meshmark, request.records, feedback)}
        report = meshmark.verify(
            suspect,
            reference,
            key,
            **marks,
            evidence_map=bool(request.evidence),
            exact_displacements=request.is_exact,
            progress=package.progress(feedback),
        )
        if feedback.isCanceled():
            raise Cancelled()
        if request.evidence:
            with tempfile.TemporaryDirectory(prefix="meshmark-") as staging:
                staged = os.path.join(staging, "evidence.gpkg")
                maps.write(staged, meshmark.evidence_map(report), LAYERS, FIELDS)
                with open(staged, "rb") as file:
                    files.write_new(request.evidence, file.read())
        if request.report:
            files.write_new(request.report, report.to_html().encode())
        return report.to_dict()


def _records(meshmark, folder, feedback):
    """Returns the records of a folder by their names, without files that are no records."""
    found = {}
    for entry in sorted(os.scandir(folder), key=lambda entry: entry.name):
        if entry.name.lower().endswith(".json") and entry.is_file():
            try:
                found[entry.name] = meshmark.Record.read(entry.path)
            except meshmark.MeshmarkError as error:
                feedback.pushWarning(tr("{} is left out: it is no record ({}).").format(entry.name, error))
    if not found:
        raise QgsProcessingException(tr("{} has no record (*.json): choose the folder of the records.").format(folder))
    return found


def compare(request, feedback):
    """Returns the comparison as data; writes the report."""
    if request.report:
        files.check_is_free(request.report)
    with package.reported(feedback) as meshmark:
        original = maps.read(meshmark, request.original, feedback)
        marked = maps.read(meshmark, request.marked, feedback)
        if request.layers:
            original, marked = (_chosen(layers, request.layers) for layers in (original, marked))
        comparison = meshmark.compare(original, marked, precision=request.precision)
        if feedback.isCanceled():
            raise Cancelled()
        if request.report:
            files.write_new(request.report, comparison.to_html().encode())
        return comparison.to_dict()


def _chosen(layers, names):
    """Returns layers of these names, which are separated by commas, those with a comma in double quotes."""
    wanted = next(csv.reader([names], skipinitialspace=True))
    for name in wanted:
        if name not in layers:
            raise QgsProcessingException(tr("There is no layer {}: the layers are {}.").format(name, ", ".join(layers)))
    return {name: layer for name, layer in layers.items() if name in wanted}


def make_key(path):
    """Makes a key in a new file that only its owner can read."""
    meshmark = package.find()
    try:
        meshmark.Key.generate().write(path)
    except FileExistsError as error:
        raise QgsProcessingException(
            tr("{} exists: a key is never overwritten; name another file.").format(path)
        ) from error
    except (meshmark.MeshmarkError, OSError) as error:
        raise QgsProcessingException(str(error)) from error
