"""Layers of any kind as well-known binary, and back."""

import numpy
import shapely

from ._attributes import texts_of, values_of, values_of_series
from ._crs import Crs


class Layer:
    """A layer of well-known binary, for programs that have features but no GeoDataFrame, such as QGIS.

    Parameters
    ----------
    geometries : sequence of bytes or None
        The geometries, with heights and measures; None for a missing one.
    crs : optional
        The CRS, whatever ``pyproj.CRS`` takes.
    attributes : dict of str to sequence, optional
        The values of the features by column. Texts and integers help a verification to find places.
    ids : sequence, optional
        The ids by which messages name the features; their numbers by default.

    Examples
    --------
    >>> import meshmark, shapely
    >>> houses = [shapely.box(20 * x, 20 * y, 20 * x + 9 + (x * y) % 5, 20 * y + 8) for x in range(20) for y in range(20)]
    >>> town = meshmark.Layer(shapely.to_wkb(houses).tolist(), "EPSG:3067")
    >>> copy, record = meshmark.mark(town, meshmark.Key.generate(), recipient="ACME GmbH")
    >>> len(copy.geometries)
    400
    """

    def __init__(self, geometries, crs=None, attributes=None, ids=None):
        self.geometries = list(geometries)
        self.crs = crs
        self.attributes = dict(attributes or {})
        self.ids = ids
        for name, values in [*self.attributes.items(), *([("ids", ids)] if ids is not None else [])]:
            if len(values) != len(self.geometries):
                raise ValueError(f"{name} has {len(values)} values, and there are {len(self.geometries)} geometries")


class Column:
    """A geometry column of a layer, as the extension takes it."""

    # Texts and integers of each feature, by which a verification finds places; of the first column of a layer.
    attributes = None

    def __init__(self, layer, geometries, crs, index=None):
        self.name = layer
        self.geometries = geometries
        self.crs = Crs(crs) if crs is not None else None
        self._index = index

    def fid(self, number):
        """Return the name of a feature for messages."""
        return str(number if self._index is None else self._index[number])


class Frame:
    """A GeoDataFrame."""

    def __init__(self, name, frame):
        self.frame = frame
        self.names = [column for column, dtype in frame.dtypes.items() if str(dtype) == "geometry"]
        for column, dtype in frame.dtypes.items():
            if dtype == object and shapely.is_geometry(frame[column].to_numpy()).any():
                raise TypeError(
                    f"column {column!r} of layer {name!r} holds geometries, and would not be marked: make it a geometry "
                    "column with frame.set_geometry, or drop it"
                )
        self.columns = [
            Column(name, wkb_of(frame[column].to_numpy()), frame[column].crs, frame.index) for column in self.names
        ]

    def attributes(self):
        """Return names and values of the other columns."""
        others = [number for number, name in enumerate(self.frame.columns) if name not in self.names]
        columns = {str(self.frame.columns[number]): self.frame.iloc[:, number] for number in others}
        return {name: values_of_series(column) for name, column in columns.items()}

    def moved(self, geometries):
        """Return a copy with these geometries, those of each column."""
        copy = self.frame.copy()
        for name, moved in zip(self.names, geometries):
            series = self.frame[name]
            copy[name] = type(series)(shapely.from_wkb(moved), index=series.index, crs=series.crs)
        return copy


class Series:
    """A GeoSeries."""

    def __init__(self, name, series):
        self.series = series
        self.columns = [Column(name, wkb_of(series.to_numpy()), series.crs, series.index)]

    def attributes(self):
        """Return nothing: a series has no other columns."""
        return {}

    def moved(self, geometries):
        """Return a copy with these geometries."""
        series = self.series
        array = shapely.from_wkb(geometries[0])
        return type(series)(array, index=series.index, crs=series.crs, name=series.name)


class Binary:
    """A `Layer`."""

    def __init__(self, name, layer):
        self.layer = layer
        self.columns = [Column(name, layer.geometries, layer.crs, layer.ids)]

    def attributes(self):
        """Return names and values of the columns."""
        return {name: values_of(values) for name, values in self.layer.attributes.items()}

    def moved(self, geometries):
        """Return a copy with these geometries."""
        return Layer(geometries[0], self.layer.crs, self.layer.attributes, self.layer.ids)


class Array:
    """An array of shapely's geometries, without a CRS of its own."""

    def __init__(self, name, array):
        self.shape = array.shape
        self.columns = [Column(name, wkb_of(array.ravel()), None)]

    def attributes(self):
        """Return nothing: an array has no other columns."""
        return {}

    def moved(self, geometries):
        """Return an array of the same shape with these geometries."""
        moved = numpy.empty(len(geometries[0]), dtype=object)
        moved[:] = shapely.from_wkb(geometries[0])
        return moved.reshape(self.shape)


# Geometries have no measures before GEOS 3.12, which writes none then.
MOST_DIMENSIONS = 4 if shapely.geos_version >= (3, 12, 0) else 3


def wkb_of(array):
    """Return geometries as well-known binary, heights and measures included."""
    return shapely.to_wkb(array, output_dimension=MOST_DIMENSIONS, byte_order=1, flavor="iso").tolist()


class Sources:
    """The layers of a map, whichever kind they have."""

    def __init__(self, layers, geometry, is_shared=False):
        self.is_named = isinstance(layers, dict)
        given = layers if self.is_named else {"layer": layers}
        self.layers = {name: source(name, layer, geometry, is_shared) for name, layer in given.items()}

    @property
    def columns(self):
        """The geometry columns of all layers."""
        return [column for layer in self.layers.values() for column in layer.columns]

    def moved(self, geometries):
        """Return copies of the layers with these geometries, those of each column."""
        moved = iter(geometries)
        copies = {name: layer.moved([next(moved) for _ in layer.columns]) for name, layer in self.layers.items()}
        return copies if self.is_named else copies["layer"]


class Map:
    """A map that is verified, as the extension takes it; the fields of these names become attributes, or all."""

    def __init__(self, layers, geometry, fields=None):
        sources = Sources(layers, geometry, is_shared=True)
        self.uses_geometry = any(geometry in getattr(layer, "table_columns", ()) for layer in sources.layers.values())
        self.is_named, self.layers = sources.is_named, sources.columns
        self.fields = set()
        for layer in sources.layers.values():
            columns = layer.attributes()
            self.fields.update(columns)
            layer.columns[0].attributes = texts_of(columns, len(layer.columns[0].geometries), fields)


def maps_of(all, geometry, fields=None):
    """Return maps of which `geometry` names the column of those tables that have no metadata."""
    maps = [Map(layers, geometry, fields if number else None) for number, layers in enumerate(all)]
    if geometry is not None and not any(map.uses_geometry for map in maps):
        raise TypeError(f"geometry={geometry!r} is for tables without metadata, and no map has such a column: leave it out")
    return maps


def source(name, layer, geometry, is_shared=False):
    """Return a layer of whichever kind; `geometry` names the geometry column of a table without metadata.

    Where several maps share it, it does not concern those that have geometry columns of their own.
    """
    if geometry is not None and not is_shared and (hasattr(layer, "geom_type") or isinstance(layer, (numpy.ndarray, Layer))):
        raise TypeError(f"geometry={geometry!r} is for tables without metadata, and layer {name!r} is none")
    if isinstance(layer, Layer):
        return Binary(name, layer)
    if hasattr(layer, "geom_type") and hasattr(layer, "index"):
        return (Frame if hasattr(layer, "columns") else Series)(name, layer)
    if any(str(dtype) == "geometry" for dtype in getattr(layer, "dtypes", ())):
        raise TypeError(
            f"layer {name!r} has no active geometry column: name one with geopandas.GeoDataFrame(frame, geometry=...)"
        )
    if str(getattr(layer, "dtype", "")) == "geometry":
        layer = numpy.asarray(layer, dtype=object)
    if isinstance(layer, numpy.ndarray) and layer.dtype == object:
        return Array(name, layer)
    if hasattr(layer, "__arrow_c_stream__"):
        try:
            from ._arrow import Table
        except ImportError:
            raise ImportError('a table needs pyarrow: pip install "meshmark[arrow]"') from None
        return Table(name, layer, geometry, is_shared)
    raise TypeError(
        f"layer {name!r} is a {type(layer).__name__}, and not a GeoDataFrame, an array of shapely's geometries or a "
        "table with the Arrow interface: make one with geopandas.GeoDataFrame(..., geometry=..., crs=...)"
    )
