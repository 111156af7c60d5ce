"""Reading back: whether a written file has the places that were meant, and the mark.

Drivers of GDAL may fail silently, and formats round coordinates, reverse rings and reorder features.
"""

from collections import Counter

from osgeo import ogr
from qgis.core import QgsProcessingException

from .text import tr


def check_places(meant, found, decimals, name):
    """Raises unless two layers have the same places: every bit where `decimals` is None."""
    wanted, there = ([_places(wkb) for wkb in layer.geometries] for layer in (meant, found))
    if len(wanted) != len(there):
        _not_kept(name, tr("{} features were meant, {} are there").format(len(wanted), len(there)))
    if decimals is None:
        # The order of features may differ.
        if Counter(map(_sorted, wanted)) != Counter(map(_sorted, there)):
            _not_kept(name, tr("other coordinates"))
    elif not all(_are_near(*pair, 10.0**-decimals) for pair in zip(wanted, there)):
        _not_kept(name, tr("other coordinates"))


def _not_kept(name, difference):
    raise QgsProcessingException(
        tr("The layer {} was not kept by the format ({}), and no copy was made: choose another format.").format(
            name, difference
        )
    )


def _places(wkb):
    """Returns x and y of all vertices of a geometry; none of a missing one."""
    return list(_of_geometry(ogr.CreateGeometryFromWkb(wkb))) if wkb is not None else []


def _of_geometry(geometry):
    if geometry.GetGeometryCount():
        for number in range(geometry.GetGeometryCount()):
            yield from _of_geometry(geometry.GetGeometryRef(number))
    elif not geometry.IsEmpty():
        # −0.0 equals 0.0.
        yield from ((x, y) for x, y, *_ in geometry.GetPoints())


def _sorted(places):
    return tuple(sorted(places))


def _are_near(meant, found, distance):
    """Returns whether every place that was meant is found within a distance along x and y."""
    if len(meant) != len(found):
        return False
    cells = {}
    for x, y in found:
        cells.setdefault((round(x / distance), round(y / distance)), []).append((x, y))
    return all(any(_are_close(place, other, distance) for other in _around(cells, place, distance)) for place in meant)


def _around(cells, place, distance):
    x, y = (round(value / distance) for value in place)
    for column in (x - 1, x, x + 1):
        for row in (y - 1, y, y + 1):
            yield from cells.get((column, row), ())


def _are_close(one, other, distance):
    return abs(one[0] - other[0]) <= distance and abs(one[1] - other[1]) <= distance
