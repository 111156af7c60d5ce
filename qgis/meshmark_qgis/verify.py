"""Verify suspect map: verifies it and adds the evidence as layers."""

import math
import tempfile

from qgis.core import (
    QgsProcessing,
    QgsProcessingContext,
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterFile,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterVectorLayer,
)

from . import engines, files, reports, settings, styles
from .algorithm import Algorithm, Inputs
from .requests import Verification
from .text import tr

# The parameter that asks for the exact displacements of vertices.
EXACT = "EXACT_DISPLACEMENTS"


class Verify(Algorithm):
    NAME = "verify"

    def title(self):
        return tr("Verify suspect map")

    def about(self):
        return tr(
            "Determines whether a suspect map is a copy that was marked with your key, and whose. With one record it"
            " tests that copy; with a folder of records it finds the recipient. The result is a verdict with the"
            " probability that a map fits so well by chance, a report, and two layers: the matched vertices, coloured"
            " by their agreement with their neighbours, and the patches of the mesh with the evidence of each."
        )

    def needs(self):
        engines.verification()

    def initAlgorithm(self, configuration=None):
        vector = QgsProcessing.SourceType.TypeVectorAnyGeometry
        self.add(
            QgsProcessingParameterVectorLayer("REFERENCE", tr("Reference (the unmarked map)"), [vector]),
            tr(
                "The .reference.gpkg of the export, or the map that was marked, unchanged. All layers of the file"
                " are used."
            ),
        )
        self.add(
            QgsProcessingParameterVectorLayer("SUSPECT", tr("Suspect map"), [vector]),
            tr(
                "The map in question. All layers of its file are used; a layer with a filter or unsaved edits is"
                " used as it is displayed."
            ),
        )
        self.add(
            QgsProcessingParameterFile("KEY", tr("Key file"), defaultValue=settings.get(settings.KEY_FILE) or None),
            tr("The secret key with which the map was marked. Only its path is passed on."),
        )
        self.add(
            QgsProcessingParameterFile("RECORD", tr("Record"), optional=True, extension="json"),
            tr("The record of one copy, to test whether the suspect is that copy. It takes precedence over the folder."),
        )
        folder = QgsProcessingParameterFile.Behavior.Folder
        self.add(
            QgsProcessingParameterFile(
                "RECORDS",
                tr("Record folder"),
                folder,
                defaultValue=settings.get(settings.RECORD_FOLDER) or None,
                optional=True,
            ),
            tr("The records of all copies, to identify the recipient of the suspect."),
        )
        self.add(
            QgsProcessingParameterFileDestination(
                "EVIDENCE_MAP", tr("Evidence map"), tr("GeoPackage (*.gpkg)"), optional=True, createByDefault=True
            ),
            tr(
                "The GeoPackage that receives the matched vertices and the patches; both are added to the project."
            ),
        )
        self.add(
            QgsProcessingParameterBoolean(EXACT, tr("Exact displacements"), False),
            tr(
                "Draws an arrow for the displacement of every matched vertex. With these displacements and the unmarked"
                " map anyone can make the mark of this copy again: keep evidence map and report as secret as the"
                " records."
            ),
        )
        reports.add_parameters(self)
        self.addOutput(QgsProcessingOutputString("VERDICT", tr("Verdict: match, no-match or inconclusive")))
        self.addOutput(QgsProcessingOutputString("REASON", tr("Why")))
        self.addOutput(QgsProcessingOutputString("RECIPIENT", tr("Recipient of the copy; empty without a match")))
        self.addOutput(QgsProcessingOutputNumber("P_VALUE_LOG10", tr("Probability of such a fit by chance, decimal logarithm")))
        self.addOutput(QgsProcessingOutputNumber("MATCHED_VERTICES", tr("Matched vertices")))

    def objection(self, given, context):
        marks = [self.parameterAsString(given, name, context) for name in ("RECORD", "RECORDS")]
        return None if any(marks) else tr("Give a record, or a folder of records.")

    def prepare(self, given, context, feedback):
        self._reference = self.map_layer(given, "REFERENCE", context)
        self._suspect = self.map_layer(given, "SUSPECT", context)
        return True

    def process(self, given, context, feedback):
        evidence = self.parameterAsFileOutput(given, "EVIDENCE_MAP", context)
        self._report = reports.Report(self, given, context, feedback)
        with tempfile.TemporaryDirectory(prefix="meshmark-") as staging:
            inputs = Inputs(self._report.path, staging)
            copies = [inputs.place(self._reference, "reference"), inputs.place(self._suspect, "suspect")]
            is_exact = bool(evidence or self._report.path) and self.parameterAsBool(given, EXACT, context)
            with files.all_or_nothing([evidence, self._report.path, *copies]):
                request = Verification(
                    reference=inputs.path(self._reference, "reference", context, feedback),
                    suspect=inputs.path(self._suspect, "suspect", context, feedback),
                    key=self.parameterAsString(given, "KEY", context),
                    record=self.parameterAsString(given, "RECORD", context),
                    records=self.parameterAsString(given, "RECORDS", context),
                    evidence=evidence,
                    report=self._report.path,
                    is_exact=is_exact,
                )
                feedback.setProgressText(tr("Verifying"))
                found = engines.verification().verify(request, feedback)
        for line in summary(found):
            feedback.pushInfo(line)
        if evidence and context.project():
            self._add_layers(evidence, is_exact, context)
        results = {
            "VERDICT": found["verdict"],
            "REASON": found["reason"],
            "RECIPIENT": ", ".join(recipients(found)),
            "P_VALUE_LOG10": found["p_value_log10"],
            "MATCHED_VERTICES": found["vertices"]["matched"],
        }
        written = {"EVIDENCE_MAP": evidence, "REPORT": self._report.path}
        return {**results, **{name: path for name, path in written.items() if path}}

    def _add_layers(self, evidence, is_exact, context):
        displacements = ("vertex_displacements", tr("Displacements"))
        vertices = displacements if is_exact else ("matched_vertices", tr("Matched vertices"))
        for layer, title in [("patches", tr("Patches")), vertices]:
            details = QgsProcessingContext.LayerDetails(title, context.project(), layer)
            details.setPostProcessor(styles.processor(layer))
            context.addLayerToLoadOnCompletion(f"{evidence}|layername={layer}", details)

    def postProcessAlgorithm(self, context, feedback):
        self._report.open()
        return {}


def recipients(found):
    """Returns the recipients of matching copies: several for a mixture, none without a match."""
    if found["verdict"] != "match":
        return []
    if not found["candidates"]:
        named = [found["parameters"]["recipient"]]
    else:
        most = math.log10(found["parameters"]["significance"])
        tried = [entry for entry in found["candidates"]["list"] if entry["p_value_log10"] is not None]
        named = [entry["recipient"] for entry in tried if entry["p_value_log10"] < most]
    # Records of one recipient count as one answer; a message given as bits names no recipient.
    return list(dict.fromkeys(filter(None, named)))


def summary(found):
    """Returns the answer in a few lines."""
    verdicts = {"match": tr("MATCH"), "no-match": tr("NO MATCH"), "inconclusive": tr("INCONCLUSIVE")}
    yield f"{verdicts.get(found['verdict'], found['verdict'])}: {found['reason']}"
    p_log10 = found["p_value_log10"]
    for recipient in recipients(found):
        yield tr("Recipient: {}").format(recipient)
    if p_log10 is not None:
        yield tr("Probability of so much agreement by chance: 10^{:.1f}").format(p_log10)
    vertices = found["vertices"]
    yield tr("{} of {} reference vertices were found among {} of the suspect.").format(
        vertices["matched"], vertices["reference"], vertices["suspect"]
    )
