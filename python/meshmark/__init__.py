"""Watermarks for vector maps: mark GeoDataFrames for a recipient, and verify whose copy one is.

    >>> import geopandas, shapely
    >>> houses = [shapely.box(20 * x, 20 * y, 20 * x + 9 + (x * y) % 5, 20 * y + 8) for x in range(20) for y in range(20)]
    >>> town = geopandas.GeoDataFrame(geometry=houses, crs="EPSG:3067")
    >>> key = Key.generate()
    >>> copy, record = mark(town, key, recipient="ACME GmbH")
    >>> record.recipient
    'ACME GmbH'
    >>> bool(copy.distance(town).max() < 0.75)
    True
    >>> verify(copy, town, key, record).verdict
    'match'

The command ``meshmark verify`` recognises the copy as well.
"""

from ._comparison import compare
from ._distribution import distribute
from ._evidence import evidence_map
from ._layers import Layer
from ._marking import mark
from ._meshmark import (
    Comparison,
    Key,
    KeyFileError,
    MapError,
    MeshmarkError,
    OptionError,
    Record,
    RecordError,
    Report,
    __version__,
    creation_option_list,
)
from ._verification import verify

__all__ = [
    "Comparison",
    "Key",
    "KeyFileError",
    "Layer",
    "MapError",
    "MeshmarkError",
    "OptionError",
    "Record",
    "RecordError",
    "Report",
    "compare",
    "creation_option_list",
    "distribute",
    "evidence_map",
    "mark",
    "verify",
]
