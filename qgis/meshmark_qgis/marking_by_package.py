"""Marking with the Python package meshmark: the geometries of a GeoPackage go through it as well-known
binary, and the GDAL of QGIS writes the file."""

import hashlib
import json
import os
import shutil
from collections import namedtuple

from osgeo import gdal
from qgis.core import QgsProcessingException

from . import maps, option_list, package, publication, read_back
from .commands import Cancelled
from .text import tr

# A format of marked maps. Coordinates have so many decimals, all bits where they are None; `is_wgs84` says that
# the driver would reproject another CRS after the marking.
Format = namedtuple("Format", "driver many_layers decimals is_wgs84")
BINARY = {"many_layers": False, "decimals": None, "is_wgs84": False}
FORMATS = {
    ".gpkg": Format("GPKG", True, None, False),
    ".shp": Format("ESRI Shapefile", **BINARY),
    ".fgb": Format("FlatGeobuf", **BINARY),
    # GDAL removes digits that look like rounding errors: see the tolerance of the comparison.
    ".geojson": Format("GeoJSON", False, 8, False),
    ".json": Format("GeoJSON", False, 8, False),
    ".geojsonl": Format("GeoJSONSeq", False, 7, True),
    ".geojsons": Format("GeoJSONSeq", False, 7, True),
}
# A marked map: key and layers as they were given, the moved layers, the record.
Marking = namedtuple("Marking", "key layers moved record")
# Options of the list that the plugin handles itself, and those that shape the mark.
OWN = ("KEY", "RECORD", "REFERENCE", "OVERWRITE", "ATTRIBUTES")
OF_MARK = (
    "RECIPIENT", "MESSAGE", "SRS", "AMPLITUDE", "BASIS", "CHIP_RATE", "CODE", "PART_SIZE", "PATCH_SIZE", "PRECISION",
    "SHAPE", "TOLERANCE",
)  # fmt: skip
# Percents of the progress at the end of each step.
READ, MARKED, WRITTEN = 5, 80, 90
# Displacements of this size, metres RMS, outweigh 7 decimals of a degree, at most 0.6 cm, by far.
MOST_ROUNDED_M = 0.5


def find():
    """Raises Missing unless the package is installed."""
    package.find()


def options():
    """Returns the list of the driver, which the package has as well."""
    return option_list.parsed(package.find().creation_option_list())


def export(source, output, values, feedback):
    """Marks a GeoPackage; the values of options are texts."""
    form, target = _format_of(output), os.path.realpath(output)
    _check_options(values)
    _check_target(target, values["KEY"])
    with package.reported(feedback) as meshmark:
        feedback.pushInfo(tr("Only the GDAL driver searches attributes for unmarked coordinates."))
        marking = _mark(meshmark, source, (form, values), feedback)
        folder, records = os.path.dirname(target), os.path.dirname(os.path.abspath(values["RECORD"]))
        with publication.Workplaces(folder, records) as workplaces:
            made = os.path.join(workplaces.of(folder), "out")
            os.mkdir(made)
            copy = os.path.join(made, os.path.basename(target))
            feedback.setProgressText(tr("Writing"))
            _write(source, marking.moved, copy, form, feedback)
            feedback.setProgressText(tr("Reading back"))
            _check_copy(meshmark, copy, (form, marking), feedback)
            staged = [os.path.join(workplaces.of(records), name) for name in ("record.json", "reference.gpkg")]
            shutil.copyfile(source, staged[1])
            _write_record(marking.record, staged, made)
            names = [name for name in sorted(os.listdir(made)) if name != os.path.basename(target)]
            companions = [*zip(staged, (values["RECORD"], values["REFERENCE"]))]
            companions += [(os.path.join(made, name), os.path.join(folder, name)) for name in names]
            if feedback.isCanceled():
                raise Cancelled()
            replaces = values.get("OVERWRITE") == "YES"
            publication.publish(workplaces.of(folder), companions, (copy, target), replaces)


def _mark(meshmark, source, request, feedback):
    form, values = request
    feedback.setProgressText(tr("Marking with the Python package meshmark {}").format(meshmark.__version__))
    key = meshmark.Key.read(values["KEY"])
    layers = maps.read(meshmark, source, feedback)
    _check_layers(form, layers)
    options = {name.lower(): value for name, value in values.items() if name in OF_MARK}
    moved, record = meshmark.mark(layers, key, progress=package.progress(feedback, READ, MARKED), **options)
    return Marking(key, layers, moved, record)


def _check_copy(meshmark, copy, meant, feedback):
    """Raises unless a written file has the places and the mark that were meant."""
    form, marking = meant
    found = maps.read(meshmark, copy, feedback, form.driver)
    _check_places(form, marking.moved, found)
    if form.is_wgs84:
        _check_mark(meshmark, found, marking, feedback)


def _write_record(record, staged, made):
    """Writes the record with the digests of the reference and, where it is one file, of the copy in `made`."""
    path, reference = staged
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write(record.with_file_digests(_digest(reference), _digest_of_only_file(made)).to_json())


def _check_options(values):
    """Raises for an option that only the driver has."""
    unknown = sorted(name for name in values if name not in OWN + OF_MARK)
    if values.get("ATTRIBUTES") == "REFUSE":
        unknown.append("ATTRIBUTES=REFUSE")
    if unknown:
        raise QgsProcessingException(
            tr("The Python package meshmark has no option {}: leave it out, or install the GDAL driver.").format(
                unknown[0]
            )
        )


def _format_of(output):
    ending = os.path.splitext(output)[1].lower()
    if ending not in FORMATS:
        known = ", ".join(dict.fromkeys(form.driver for form in FORMATS.values()))
        raise QgsProcessingException(
            tr("{} has the ending of no format that keeps a mark ({}): write a GPKG and convert it.").format(
                output, known
            )
        )
    return FORMATS[ending]


def _check_layers(form, layers):
    if len(layers) > 1 and not form.many_layers:
        raise QgsProcessingException(
            tr("A file of the format {} holds one layer: write a GPKG, or export one layer.").format(form.driver)
        )
    if not form.is_wgs84:
        return
    from pyproj import CRS

    for name, layer in layers.items():
        if layer.crs is not None and not CRS(layer.crs).equals(CRS("EPSG:4326"), ignore_axis_order=True):
            raise QgsProcessingException(
                tr(
                    "{} holds longitudes and latitudes of WGS 84 only, and the layer {} has another CRS: reproject it"
                    " to EPSG:4326 first, or choose another format."
                ).format(form.driver, name)
            )


def _check_target(target, key):
    """Raises when the file is the key, or another program writes to it, whose journal would be applied to the
    new file."""
    if os.path.exists(target) and os.path.exists(key) and os.path.samefile(target, key):
        raise QgsProcessingException(tr("{} is the key file: choose another file for the map.").format(target))
    for sidecar in (f"{target}-wal", f"{target}-journal"):
        if os.path.exists(sidecar) and os.path.getsize(sidecar) > 0:
            raise QgsProcessingException(
                tr("Another program writes to {} ({} exists): close the file there.").format(target, sidecar)
            )


def _write(source, moved, copy, form, feedback):
    """Writes the marked layers as `ogr2ogr` writes those of the source."""
    marked = os.path.join(os.path.dirname(os.path.dirname(copy)), "marked.gpkg")
    shutil.copyfile(source, marked)
    maps.move(marked, moved, feedback)
    dataset = maps.opened(marked, gdal.OF_VECTOR | gdal.OF_READONLY, "GPKG")

    def show(done, *_):
        feedback.setProgress(MARKED + (WRITTEN - MARKED) * done)
        return 0 if feedback.isCanceled() else 1

    gdal.ErrorReset()
    try:
        written = gdal.VectorTranslate(copy, dataset, format=form.driver, callback=show)
    except RuntimeError:
        written = None
    if feedback.isCanceled():
        raise Cancelled()
    if written is None:
        raise QgsProcessingException(
            tr("{} cannot be written: {}").format(os.path.basename(copy), gdal.GetLastErrorMsg())
        )
    del written
    maps.check(os.path.basename(copy))


def _check_places(form, moved, found):
    for name, layer in moved.items():
        # The only layer of a file may have the name of the file.
        in_file = found.get(name) if form.many_layers else next(iter(found.values()))
        if in_file is None:
            raise QgsProcessingException(
                tr("The layer {} is missing in the written file: choose another format.").format(name)
            )
        read_back.check_places(layer, in_file, form.decimals, name)


def _check_mark(meshmark, found, marking, feedback):
    """Raises unless the mark can be read from layers that were read back. The package has read it from the moved
    places, so this is for formats that round them."""
    recorded = json.loads(marking.record.to_json())
    if recorded["displacement"]["rms_m"] > MOST_ROUNDED_M:
        return
    suspect = dict(zip(marking.layers, found.values()))
    sought = {"record": marking.record, "registration": "none", "progress": package.progress(feedback, WRITTEN, 100)}
    report = meshmark.verify(suspect, marking.layers, marking.key, **sought)
    message = recorded.get("message")
    if not (report.is_match if message is None else report.message == message):
        raise QgsProcessingException(
            tr(
                "The mark of {} cannot be read from the written file ({}): choose a format with more digits, or raise"
                " AMPLITUDE."
            ).format(marking.record.recipient or message, report.reason)
        )


def _digest(path):
    found = hashlib.sha256()
    with open(path, "rb") as file:
        for block in iter(lambda: file.read(1 << 20), b""):
            found.update(block)
    return found.hexdigest()


def _digest_of_only_file(folder):
    """Returns the digest of the file in a folder; None where there are several, as of a Shapefile."""
    names = os.listdir(folder)
    return _digest(os.path.join(folder, names[0])) if len(names) == 1 else None
