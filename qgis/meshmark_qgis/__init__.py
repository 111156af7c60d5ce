"""The QGIS plugin of meshmark: it drives the GDAL driver MESHMARK and the command meshmark."""


def classFactory(iface):  # noqa: N802, QGIS calls it so
    from .plugin import MeshmarkPlugin

    return MeshmarkPlugin(iface)
