"""Files of maps as layers of the Python package meshmark, and back."""

from osgeo import gdal, ogr, osr
from qgis.core import QgsProcessingException

from .commands import Cancelled
from .text import tr

# The types of fields whose values help a verification to find places.
TEXTS_AND_INTEGERS = (ogr.OFTString, ogr.OFTInteger, ogr.OFTInteger64)
# So many features are read between two looks at a request to cancel.
BATCH = 1000


def read(package, path, feedback, driver=None):
    """Returns the layers of a file by their names; `driver` is the only one that may open it."""
    dataset = opened(path, gdal.OF_VECTOR | gdal.OF_READONLY, driver)
    found = {}
    for number in range(dataset.GetLayerCount()):
        layer = dataset.GetLayer(number)
        for column in range(layer.GetLayerDefn().GetGeomFieldCount()):
            name = layer.GetName() if column == 0 else f"{layer.GetName()}, {column + 1}"
            found[name] = _layer(package, path, layer, column, feedback)
    if not found:
        raise QgsProcessingException(tr("{} has no layer with geometries: choose another file.").format(path))
    return found


def opened(path, flags, driver=None):
    """Opens a dataset; raises with GDAL's reason when it cannot."""
    gdal.ErrorReset()
    try:
        dataset = gdal.OpenEx(path, flags, allowed_drivers=[driver] if driver else [])
    except RuntimeError:
        dataset = None
    if dataset is None:
        raise QgsProcessingException(
            tr("{} cannot be opened ({}): choose another file.").format(
                path, gdal.GetLastErrorMsg() or tr("unknown format")
            )
        )
    return dataset


def check(path):
    """Raises when GDAL reported a failure on this thread since its errors were reset."""
    if gdal.GetLastErrorType() >= gdal.CE_Failure:
        raise QgsProcessingException(
            tr("{} was not read or written completely ({}): check the file and its folder.").format(
                path, gdal.GetLastErrorMsg()
            )
        )


def _layer(package, path, layer, column, feedback):
    definition = layer.GetLayerDefn()
    fields = {}
    for number in range(definition.GetFieldCount()):
        field = definition.GetFieldDefn(number)
        if field.GetType() in TEXTS_AND_INTEGERS:
            fields[number] = field.GetName()
    geometries, ids, values = [], [], {number: [] for number in fields}
    gdal.ErrorReset()
    layer.ResetReading()
    for count, feature in enumerate(layer):
        if count % BATCH == 0 and feedback.isCanceled():
            raise Cancelled()
        geometry = feature.GetGeomFieldRef(column)
        geometries.append(None if geometry is None else bytes(geometry.ExportToIsoWkb()))
        ids.append(feature.GetFID())
        for number, column_values in values.items():
            column_values.append(feature.GetField(number) if feature.IsFieldSetAndNotNull(number) else None)
    check(path)
    attributes = {fields[number]: column_values for number, column_values in values.items()}
    return package.Layer(geometries, _crs(definition.GetGeomFieldDefn(column).GetSpatialRef()), attributes, ids)


def _crs(srs):
    """Returns the text of a CRS; None for one that is undefined, as in GeoPackages that were written without."""
    if srs is None or (srs.GetName() or "").startswith("Undefined "):
        return None
    return srs.ExportToWkt(["FORMAT=WKT2_2019"])


def move(path, moved, feedback):
    """Gives the features of a GeoPackage the geometries of layers that were read from it."""
    dataset = opened(path, gdal.OF_VECTOR | gdal.OF_UPDATE)
    gdal.ErrorReset()
    dataset.StartTransaction()
    for name, layer in moved.items():
        table = dataset.GetLayerByName(name)
        for count, (fid, wkb) in enumerate(zip(layer.ids, layer.geometries)):
            if count % BATCH == 0 and feedback.isCanceled():
                raise Cancelled()
            if wkb is None:
                continue
            feature = table.GetFeature(fid)
            feature.SetGeometryDirectly(ogr.CreateGeometryFromWkb(wkb))
            table.SetFeature(feature)
    dataset.CommitTransaction()
    check(path)


def write(path, layers, types, fields):
    """Writes layers to a new GeoPackage; `types` are those of the geometries of each, `fields` those of the
    values of each column."""
    gdal.ErrorReset()
    dataset = ogr.GetDriverByName("GPKG").CreateDataSource(path)
    check(path)
    for name, layer in layers.items():
        dataset.StartTransaction()
        table = dataset.CreateLayer(name, _srs(layer.crs), types[name])
        check(path)
        for field in layer.attributes:
            table.CreateField(ogr.FieldDefn(field, fields[field]))
        for number, wkb in enumerate(layer.geometries):
            feature = ogr.Feature(table.GetLayerDefn())
            for field, (_, values) in enumerate(layer.attributes.items()):
                if values[number] is not None:
                    feature.SetField(field, values[number])
            feature.SetGeometryDirectly(ogr.CreateGeometryFromWkb(wkb))
            table.CreateFeature(feature)
        dataset.CommitTransaction()
    check(path)


def _srs(crs):
    """Returns a CRS of pyproj as that of a layer."""
    if crs is None:
        return None
    srs = osr.SpatialReference()
    srs.ImportFromWkt(crs.to_wkt("WKT2_2019"))
    srs.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
    return srs
