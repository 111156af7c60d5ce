"""Export with watermark: turns layers into a marked file, its record and its reference."""

import os
import tempfile

from osgeo import gdal
from qgis.core import (
    QgsProcessing,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingOutputFile,
    QgsProcessingOutputMultipleLayers,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterFile,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterMultipleLayers,
    QgsProcessingUtils,
)

from . import engines, layers, parameters, settings
from .algorithm import Algorithm
from .missing import Missing
from .proof import Proof
from .text import tr

# Options that the algorithm sets itself: paths, and those that follow from the layers and
# the file name.
OWN = {"KEY", "RECORD", "REFERENCE", "LAYERS", "FORMAT"}


class Export(Algorithm):
    NAME = "export"

    def title(self):
        return tr("Export with watermark")

    def about(self):
        return tr(
            "Writes a copy of one or more layers that carries an invisible message in centimetre shifts of its"
            " vertices. All layers form one mesh and are marked together. The file appears when it is complete, was"
            " read back and carries the message, or not at all. Beside it a record and a reference (the unmarked"
            " map) are written to the record folder: keep both and the key, verification needs all three, and never"
            " hand them out."
        )

    def needs(self):
        engines.marking()

    def initAlgorithm(self, configuration=None):
        vector = QgsProcessing.SourceType.TypeVectorAnyGeometry
        self.add(
            QgsProcessingParameterMultipleLayers("LAYERS", tr("Layers to export"), vector),
            tr("The displayed content is exported: filters and unsaved edits apply. Several layers need a GeoPackage."),
        )
        self._options = self._listed_options()
        options = {option.name: parameters.parameter(option) for option in self._options}
        if "RECIPIENT" in options:
            self.add(
                options.pop("RECIPIENT"),
                tr("Who receives this copy; required, unless a message is given (advanced parameters)."),
            )
        output = QgsProcessingParameterFileDestination("OUTPUT", tr("Marked map"), file_filter())
        # An existing file is refused, whatever the answer.
        output.setMetadata({"widget_wrapper": {"dontconfirmoverwrite": True}})
        self.add(
            output,
            tr(
                "The file to hand out; required. Its extension chooses the format; only GeoPackage holds several"
                " layers."
            ),
        )
        self.add(
            QgsProcessingParameterFile("KEY", tr("Key file"), defaultValue=settings.get(settings.KEY_FILE) or None),
            tr("The secret key, made once by `meshmark keygen key.json`. Only its path is passed on."),
        )
        records = QgsProcessingParameterFile.Behavior.Folder
        self.add(
            QgsProcessingParameterFile(
                "RECORDS", tr("Record folder"), records, defaultValue=settings.get(settings.RECORD_FOLDER) or None
            ),
            tr("The folder for the record (.json) and the reference (.reference.gpkg), which an auditor needs."),
        )
        for made in options.values():
            self.addParameter(parameters.advanced(made))
        self.add(
            parameters.advanced(QgsProcessingParameterBoolean("ADD_TO_PROJECT", tr("Add to the project"), True)),
            tr("Loads the marked map after the export."),
        )
        self.addOutput(QgsProcessingOutputMultipleLayers("MARKED_LAYERS", tr("Marked layers")))
        self.addOutput(QgsProcessingOutputFile("RECORD", tr("Record")))
        self.addOutput(QgsProcessingOutputFile("REFERENCE", tr("Reference")))

    @staticmethod
    def _listed_options():
        """Returns none without driver and package; the algorithm then only reports that they are missing."""
        try:
            return [option for option in engines.marking().options() if option.name not in OWN]
        except Missing:
            return []

    def objection(self, given, context):
        subjects = [self.parameterAsString(given, name, context).strip() for name in ("RECIPIENT", "MESSAGE")]
        if self._options and not any(subjects):
            return tr("No recipient is given: name who receives this copy, or give a message (advanced parameters).")
        if all(subjects):
            return tr("A recipient and a message are given: give one of them, but not both.")
        if not is_kept(self.parameterAsFileOutput(given, "OUTPUT", context), context):
            return tr(
                "No file to hand out is named (Marked map): a temporary file would be lost while its record and"
                " reference stay."
            )
        return None

    def prepare(self, given, context, feedback):
        chosen = self.parameterAsLayerList(given, "LAYERS", context)
        if not chosen:
            raise QgsProcessingException(tr("No layer is given that can be opened: choose the layers to export."))
        self._snapshots = [layers.Snapshot(layer) for layer in chosen]
        return True

    def process(self, given, context, feedback):
        output = self.parameterAsFileOutput(given, "OUTPUT", context)
        values = {o.name: parameters.value(self, o, given, context) for o in self._options}
        folder = self.parameterAsString(given, "RECORDS", context)
        check_places(output, folder, values.get("OVERWRITE") == "YES")
        check_is_no_source(output, self._snapshots)
        record, reference = free_names(folder, os.path.splitext(os.path.basename(output))[0])
        values.update(KEY=self.parameterAsString(given, "KEY", context), RECORD=record, REFERENCE=reference)

        # Staged files are unmarked, so the folder is private and is removed after the run.
        with tempfile.TemporaryDirectory(prefix="meshmark-") as staging:
            source = os.path.join(staging, "source.gpkg")
            feedback.setProgressText(tr("Copying the layers"))
            names = layers.copy(self._snapshots, source, context, feedback)
            proof = Proof(output, record, reference)
            values = {name: value for name, value in values.items() if value}
            engines.marking().export(source, output, values, feedback)
            proof.check(values.get("RECIPIENT"), values.get("MESSAGE"))
        feedback.pushInfo(tr("Record: {}").format(record))
        feedback.pushInfo(tr("Reference: {}").format(reference))
        marked = layers_of(output)
        if self.parameterAsBool(given, "ADD_TO_PROJECT", context) and context.project():
            for name, source in zip(names, marked):
                details = QgsProcessingContext.LayerDetails(
                    tr("{} (marked)").format(name), context.project(), "MARKED_LAYERS"
                )
                context.addLayerToLoadOnCompletion(source, details)
        return {"OUTPUT": output, "MARKED_LAYERS": marked, "RECORD": record, "REFERENCE": reference}


def is_kept(path, context):
    """Returns whether a path is outside the temporary folder, which QGIS clears at its end."""
    folders = [QgsProcessingUtils.tempFolder()]
    # Later versions of QGIS have one for each context, too.
    if hasattr(context, "temporaryFolder") and context.temporaryFolder():
        folders.append(context.temporaryFolder())
    place = os.path.abspath(path)
    return bool(path) and not any(place.startswith(os.path.join(os.path.abspath(folder), "")) for folder in folders)


def check_places(output, folder, overwrite):
    """Reports unusable output paths before the first copy."""
    if not os.path.isdir(folder):
        raise QgsProcessingException(
            tr("The record folder {} does not exist: make it, or choose another.").format(folder or '""')
        )
    if not os.path.isdir(os.path.dirname(os.path.abspath(output))):
        raise QgsProcessingException(tr("The folder of {} does not exist: make it, or choose another.").format(output))
    if os.path.lexists(output) and not overwrite:
        raise QgsProcessingException(
            tr("{} exists: choose another file, or let it be replaced (OVERWRITE).").format(output)
        )


def check_is_no_source(output, snapshots):
    """Reports an output that would replace its own source with marked layers alone."""
    for snapshot in snapshots:
        if snapshot.file and os.path.exists(output) and os.path.samefile(snapshot.file, output):
            raise QgsProcessingException(
                tr("{} is the file of the layer {} itself: choose another file.").format(output, snapshot.name)
            )


def free_names(folder, stem):
    """Returns unused names for record and reference: existing ones are never replaced."""
    number = 1
    while True:
        base = os.path.join(folder, stem if number == 1 else f"{stem}-{number}")
        record, reference = f"{base}.json", f"{base}.reference.gpkg"
        if not os.path.lexists(record) and not os.path.lexists(reference):
            return record, reference
        number += 1


def layers_of(path):
    """Returns the URIs by which QGIS opens the layers of a file."""
    dataset = gdal.OpenEx(path, gdal.OF_VECTOR)
    names = [dataset.GetLayer(i).GetName() for i in range(dataset.GetLayerCount())]
    return [path] if len(names) == 1 else [f"{path}|layername={name}" for name in names]


def file_filter():
    return ";;".join(
        [
            tr("GeoPackage (*.gpkg)"),
            tr("Shapefile (*.shp)"),
            tr("FlatGeobuf (*.fgb)"),
            tr("GeoJSON (*.geojson)"),
            tr("GeoJSON, newline delimited (*.geojsonl)"),
        ]
    )
