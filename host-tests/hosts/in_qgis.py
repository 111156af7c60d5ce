"""Reads and writes through MESHMARK with QGIS; qgis.sh verifies the copies.

A failure must leave no file.
"""

import os
import shutil

import folder
from osgeo import gdal
from qgis.core import (
    Qgis,
    QgsApplication,
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsCoordinateTransformContext,
    QgsFeature,
    QgsGeometry,
    QgsProject,
    QgsVectorFileWriter,
    QgsVectorLayer,
)

HERE = os.getcwd()
TRANSFORMS = QgsCoordinateTransformContext()


def through_meshmark(key="key.json", layer=""):
    source = f"MESHMARK:{HERE}/map.gpkg{layer}|option:KEY={HERE}/{key}|option:RECIPIENT=B"
    return QgsVectorLayer(source, "roads through MESHMARK", "ogr")


def export_marked_layer():
    layer = through_meshmark()
    assert layer.isValid() and layer.featureCount() > 0, layer.error().message()
    source = QgsVectorLayer(f"{HERE}/map.gpkg|layername=buildings", "source", "ogr")
    assert source.isValid() and not source.startEditing(), "a map that is read through MESHMARK can be edited"
    options = QgsVectorFileWriter.SaveVectorOptions()
    options.driverName = "GPKG"
    error, message, *_ = QgsVectorFileWriter.writeAsVectorFormatV3(layer, "exported.gpkg", TRANSFORMS, options)
    assert error == QgsVectorFileWriter.NoError, message


def write(layer, target, name, key="key.json", overwrite="NO", **other):
    """Returns code and message of QgsVectorFileWriter."""
    options = QgsVectorFileWriter.SaveVectorOptions()
    options.driverName = "MESHMARK"
    options.layerName = "buildings"
    options.datasourceOptions = [
        f"KEY={HERE}/{key}",
        "RECIPIENT=ACME GmbH",
        f"REFERENCE={HERE}/{name}.reference.gpkg",
        f"RECORD={HERE}/{name}.json",
        f"OVERWRITE={overwrite}",
    ]
    for option, value in other.items():
        setattr(options, option, value)
    error, message, *_ = QgsVectorFileWriter.writeAsVectorFormatV3(layer, target, TRANSFORMS, options)
    return error, message


def succeeds(*arguments, **options):
    error, message = write(*arguments, **options)
    assert error == QgsVectorFileWriter.NoError, message


def is_refused(why, *arguments, **options):
    error, message = write(*arguments, **options)
    assert error != QgsVectorFileWriter.NoError and why in message, (error, message)


def small_layer():
    """Returns a square of one metre, which is too small to be marked."""
    layer = QgsVectorLayer("Polygon?crs=EPSG:3067", "small", "memory")
    feature = QgsFeature()
    feature.setGeometry(QgsGeometry.fromWkt("POLYGON ((0 0,1 0,1 1,0 1,0 0))"))
    layer.dataProvider().addFeatures([feature])
    return layer


def save_project():
    QgsProject.instance().addMapLayer(through_meshmark(layer="|layername=roads"))
    assert QgsProject.instance().write(f"{HERE}/map.qgs")


def write_through_meshmark(buildings):
    mercator = QgsCoordinateReferenceSystem("EPSG:3857")
    reprojected = QgsCoordinateTransform(buildings.crs(), mercator, TRANSFORMS)
    succeeds(buildings, f"MESHMARK:{HERE}/written.gpkg", "written.gpkg", ct=reprojected)
    succeeds(buildings, f"MESHMARK:{HERE}/written.shp", "written.shp", layerOptions=["SPATIAL_INDEX=YES"])
    assert os.path.exists("written.qix"), "the layer creation option did not arrive"
    shutil.copy("map.gpkg", "replaced.gpkg")
    succeeds(buildings, f"MESHMARK:{HERE}/replaced.gpkg", "replaced", overwrite="YES")


def leave_everything_as_it_was(buildings):
    target = f"MESHMARK:{HERE}/map.gpkg"
    with folder.unchanged("qgis: the target exists"):
        is_refused("map.gpkg exists", buildings, target, "other")
    with folder.unchanged("qgis: a layer would be added or appended to"):
        for action in [QgsVectorFileWriter.CreateOrOverwriteLayer, QgsVectorFileWriter.AppendToLayerNoNewFields]:
            is_refused("cannot be extended", buildings, target, "other", actionOnExistingFile=action)
    with folder.unchanged("qgis: MESHMARK: is forgotten"):
        is_refused("no name to write to", buildings, f"{HERE}/other.gpkg", "other")
    with folder.unchanged("qgis: a wrong key file, writing"):
        is_refused("wrong.json is not usable", buildings, f"MESHMARK:{HERE}/other.gpkg", "other", key="wrong.json")
    with folder.unchanged("qgis: a wrong key file, reading"):
        assert not through_meshmark(key="wrong.json").isValid()
    with folder.unchanged("qgis: closing fails, which QgsVectorFileWriter does not report"):
        succeeds(small_layer(), f"MESHMARK:{HERE}/other.gpkg", "other")
        assert "the whole map is" in gdal.GetLastErrorMsg(), gdal.GetLastErrorMsg()


application = QgsApplication([], False)
application.initQgis()
print(f"QGIS {Qgis.QGIS_VERSION} with GDAL {gdal.VersionInfo('RELEASE_NAME')}", flush=True)
buildings = QgsVectorLayer(f"{HERE}/map.gpkg|layername=buildings", "buildings", "ogr")
export_marked_layer()
write_through_meshmark(buildings)
leave_everything_as_it_was(buildings)
save_project()
