"""Watermarks for vector maps: mark GeoDataFrames for a recipient.

    >>> import geopandas, shapely
    >>> houses = [shapely.box(20 * x, 20 * y, 20 * x + 9 + (x * y) % 5, 20 * y + 8) for x in range(20) for y in range(20)]
    >>> town = geopandas.GeoDataFrame(geometry=houses, crs="EPSG:3067")
    >>> key = Key.generate()
    >>> copy, record = mark(town, key, recipient="ACME GmbH")
    >>> record.recipient
    'ACME GmbH'
    >>> bool(copy.distance(town).max() < 0.75)
    True

The command ``meshmark verify`` recognises the copy with the key, the unmarked map and the record.
"""

from ._marking import mark
from ._meshmark import (
    Key,
    KeyFileError,
    MapError,
    MeshmarkError,
    OptionError,
    Record,
    RecordError,
    __version__,
)

__all__ = [
    "Key",
    "KeyFileError",
    "MapError",
    "MeshmarkError",
    "OptionError",
    "Record",
    "RecordError",
    "mark",
]
