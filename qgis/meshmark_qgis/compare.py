"""Compare original and marked map: returns the figures of the comparison."""

import tempfile

from qgis.core import (
    QgsProcessing,
    QgsProcessingOutputNumber,
    QgsProcessingParameterNumber,
    QgsProcessingParameterString,
    QgsProcessingParameterVectorLayer,
)

from . import engines, files, reports
from .algorithm import Algorithm, Inputs
from .requests import Comparison
from .text import tr

# The ending of the names of figures that the command gives as shares of one.
PERCENT = "_PERCENT"


class Compare(Algorithm):
    NAME = "compare"

    def title(self):
        return tr("Compare original and marked map")

    def about(self):
        return tr(
            "Measures the effect of marking on a map: how far vertices moved, how angles and areas changed, and whether"
            " there are new invalid geometries, overlaps or crossings. Features correspond by their order in each"
            " layer, vertices by their order in each feature."
        )

    def needs(self):
        engines.verification()

    def initAlgorithm(self, configuration=None):
        vector = QgsProcessing.SourceType.TypeVectorAnyGeometry
        self.add(
            QgsProcessingParameterVectorLayer("ORIGINAL", tr("Original map"), [vector]),
            tr(
                "The map before it was marked: the .reference.gpkg of the export, or its source. All layers of the"
                " file are used."
            ),
        )
        self.add(
            QgsProcessingParameterVectorLayer("MARKED", tr("Marked map"), [vector]),
            tr("The map as it was exported. All layers of the file are used."),
        )
        self.add(
            QgsProcessingParameterString("LAYERS", tr("Layers to compare"), optional=True),
            tr("Names of layers, separated by commas, those with a comma in double quotes; all when empty."),
        )
        kind = QgsProcessingParameterNumber.Type.Double
        self.add(
            QgsProcessingParameterNumber("PRECISION", tr("Precision, CRS units"), kind, None, True, 0),
            tr("Grid of the marked map: overlaps up to a cell of it count as slivers."),
        )
        reports.add_parameters(self)
        for name, label, _ in figures():
            self.addOutput(QgsProcessingOutputNumber(name, label))

    def prepare(self, given, context, feedback):
        self._original = self.map_layer(given, "ORIGINAL", context)
        self._marked = self.map_layer(given, "MARKED", context)
        return True

    def process(self, given, context, feedback):
        self._report = reports.Report(self, given, context, feedback)
        with tempfile.TemporaryDirectory(prefix="meshmark-") as staging:
            inputs = Inputs(self._report.path, staging)
            copies = [inputs.place(self._original, "original"), inputs.place(self._marked, "marked")]
            is_given = given.get("PRECISION") is not None
            with files.all_or_nothing([self._report.path, *copies]):
                request = Comparison(
                    original=inputs.path(self._original, "original", context, feedback),
                    marked=inputs.path(self._marked, "marked", context, feedback),
                    layers=self.parameterAsString(given, "LAYERS", context),
                    precision=self.parameterAsDouble(given, "PRECISION", context) if is_given else None,
                    report=self._report.path,
                )
                feedback.setProgressText(tr("Comparing"))
                found = engines.verification().compare(request, feedback)
        results = {}
        for name, label, (section, figure) in figures():
            share = name.endswith(PERCENT)
            results[name] = found[section][figure] * (100 if share else 1)
            feedback.pushInfo(f"{label}: {results[name]:.3g} %" if share else f"{label}: {results[name]:.6g}")
        return {**results, "REPORT": self._report.path} if self._report.path else results

    def postProcessAlgorithm(self, context, feedback):
        self._report.open()
        return {}


def figures():
    """Returns name, label, and place of each figure in the JSON of the command."""
    return [
        ("FEATURES", tr("Features compared"), ("compared", "features")),
        ("VERTICES", tr("Vertices compared"), ("compared", "vertices")),
        ("DISPLACEMENT_RMS_M", tr("Displacement of vertices, root mean square, metres"), ("displacement", "rms_m")),
        ("DISPLACEMENT_P99_M", tr("Displacement, 99th percentile, metres"), ("displacement", "p99_m")),
        ("DISPLACEMENT_MAX_M", tr("Displacement, largest, metres"), ("displacement", "max_m")),
        ("ANGLE_MEAN_CHANGE_DEG", tr("Change of angles, mean, degrees"), ("angles", "mean_change_deg")),
        ("RIGHT_ANGLES_KEPT_PERCENT", tr("Right angles kept within 1 degree"), ("angles", "right_angles_kept")),
        ("AREA_MEAN_CHANGE_PERCENT", tr("Change of areas, mean"), ("areas", "mean_change")),
        ("AREA_MAX_CHANGE_PERCENT", tr("Change of areas, largest"), ("areas", "max_change")),
        ("NEWLY_INVALID", tr("Geometries that became invalid"), ("validity", "newly_invalid")),
        ("NEW_OVERLAPS", tr("New overlaps of polygons"), ("overlaps", "new")),
        ("NEW_CROSSINGS", tr("New crossings of lines"), ("crossings", "new")),
        ("TORN_VERTICES", tr("Shared vertices that were torn apart"), ("compared", "torn_vertices")),
    ]
