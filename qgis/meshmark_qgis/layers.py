"""Layers of QGIS as files: visible content copied to a GeoPackage, or the source file."""

import os

from qgis.core import (
    QgsFeatureRequest,
    QgsFeatureSink,
    QgsProcessingException,
    QgsProviderRegistry,
    QgsVectorFileWriter,
    QgsVectorLayer,
    QgsVectorLayerFeatureSource,
)

from .commands import Cancelled
from .text import tr

WRITERS = QgsVectorFileWriter


class Snapshot:
    """The content of a layer with its filter and unsaved edits.

    It is created in the main thread and read in any.
    """

    def __init__(self, layer):
        if not isinstance(layer, QgsVectorLayer):
            raise QgsProcessingException(tr("{} is no vector layer: leave it out.").format(layer.name()))
        if not layer.isValid():
            # Its copy would be empty.
            raise QgsProcessingException(tr("The layer {} cannot be read: repair its source.").format(layer.name()))
        self.name = own_name(layer)
        self.file = path_of(layer)
        self.fields = layer.fields()
        self.type = layer.wkbType()
        self.crs = layer.crs()
        self.count = max(layer.featureCount(), 0)
        self._source = QgsVectorLayerFeatureSource(layer)

    def features(self):
        return self._source.getFeatures(QgsFeatureRequest())


def own_name(layer):
    """Returns the name of a layer; that of its table where QGIS named it after the file."""
    source = QgsProviderRegistry.instance().decodeUri(layer.providerType(), layer.source())
    table, file = source.get("layerName"), os.path.basename(source.get("path") or "")
    generated = [os.path.splitext(file)[0], f"{os.path.splitext(file)[0]} — {table}"]
    return table if table and layer.name() in generated else layer.name()


def path_of(layer):
    """Returns the source file of a layer; None when it is not a local file."""
    path = QgsProviderRegistry.instance().decodeUri(layer.providerType(), layer.source()).get("path") or ""
    return path if os.path.exists(path) else None


def file_of(layer):
    """Returns the local file that a layer displays unchanged, None if it is filtered or edited."""
    if layer.providerType() != "ogr" or layer.subsetString() or layer.isModified():
        return None
    return path_of(layer)


def copy(snapshots, path, context, feedback):
    """Writes snapshots as layers of a new GeoPackage and returns their unique names there."""
    total = sum(snapshot.count for snapshot in snapshots)
    done, names = 0, []
    for snapshot in snapshots:
        name, number = snapshot.name or "layer", 2
        while name.lower() in (other.lower() for other in names):
            name, number = f"{snapshot.name} {number}", number + 1
        names.append(name)
        done = _copy_one(snapshot, name, path, context, _Progress(feedback, done, total))
    return names


def _copy_one(snapshot, name, path, context, progress):
    options = WRITERS.SaveVectorOptions()
    options.driverName = "GPKG"
    options.layerName = name
    if os.path.exists(path):
        options.actionOnExistingFile = WRITERS.ActionOnExistingFile.CreateOrOverwriteLayer
    transforms = context.transformContext()
    writer = WRITERS.create(path, snapshot.fields, snapshot.type, snapshot.crs, transforms, options)
    _check(writer, name)
    for feature in snapshot.features():
        if not writer.addFeature(feature, QgsFeatureSink.Flag.FastInsert):
            _check(writer, name)
        progress.step()
    if not writer.flushBuffer():
        _check(writer, name)
    del writer
    return progress.done


def _check(writer, name):
    if writer.hasError() != WRITERS.WriterError.NoError:
        reason = writer.errorMessage()
        if "duplicate column name" in reason or ("fid" in reason and "CREATE TABLE" not in reason):
            reason += tr(
                " - a field fid must hold whole numbers, every one once, and no field may be called geom: rename the"
                " field"
            )
        raise QgsProcessingException(tr("The layer {} cannot be copied: {}").format(name, reason))


class _Progress:
    def __init__(self, feedback, done, total):
        self.feedback, self.done, self.total = feedback, done, max(total, 1)

    def step(self):
        if self.feedback.isCanceled():
            raise Cancelled()
        self.done += 1
        self.feedback.setProgress(100 * self.done / self.total)
