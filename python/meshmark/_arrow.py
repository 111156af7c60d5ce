"""Tables with the Arrow interface: pyarrow, DuckDB, polars, Sedona, GeoParquet."""

import json

import numpy
import pyarrow
import shapely

from ._attributes import values_of
from ._layers import Column

# The names of the extension type for well-known binary.
EXTENSIONS = ("geoarrow.wkb", "ogc.wkb")
# What GeoParquet means where it names no CRS.
DEFAULT_CRS = "OGC:CRS84"


class Table:
    """A table whose geometry columns are well-known binary. It comes back as a table of pyarrow."""

    def __init__(self, name, layer, geometry, is_shared=False):
        self.table = pyarrow.table(layer)
        self.geo = json.loads((self.table.schema.metadata or {}).get(b"geo", b"{}"))
        if is_shared and geometry not in self.table.column_names and self._columns(name, None):
            geometry = None
        found = self._columns(name, geometry)
        if not found:
            raise TypeError(
                f"layer {name!r} has no column that its metadata call a geometry: name the column of well-known binary "
                "with geometry=, or make a GeoDataFrame of it"
            )
        self.names = self.table_columns = list(found)
        self.columns = [
            Column(name, [bytes(wkb) if wkb is not None else None for wkb in self._values(column)], crs)
            for column, crs in found.items()
        ]

    def _columns(self, name, geometry):
        """Return the CRS of each geometry column."""
        if geometry is not None:
            if self.table.column_names.count(geometry) != 1:
                names = ", ".join(self.table.column_names)
                raise TypeError(f"layer {name!r} has not one column {geometry!r}: it has {names}")
        fields = {field.name: field for field in self.table.schema}
        native = [field.name for field in fields.values() if _extension(field)[0].startswith("geoarrow.")]
        native = [column for column in native if _extension(fields[column])[0] not in EXTENSIONS]
        if native:
            raise TypeError(
                f"column {native[0]!r} of layer {name!r} is {_extension(fields[native[0]])[0]}, and would not be marked: "
                "make it well-known binary, or drop it"
            )
        described = self.geo.get("columns", {})
        for column, entry in described.items():
            if column in fields and entry.get("encoding", "WKB") != "WKB":
                raise TypeError(f"column {column!r} of layer {name!r} is {entry['encoding']}, and not WKB: write it as WKB")
        return {
            column: self._crs(field)
            for column, field in fields.items()
            if column in described or column == geometry or _extension(field)[0] in EXTENSIONS
        }

    def _crs(self, field):
        entry = self.geo.get("columns", {}).get(field.name)
        if entry is not None:
            return entry.get("crs", DEFAULT_CRS)
        return json.loads(_extension(field)[1] or "{}").get("crs")

    def _values(self, column):
        values = self.table.column(column)
        if isinstance(values.type, pyarrow.BaseExtensionType):
            values = pyarrow.chunked_array([chunk.storage for chunk in values.chunks], values.type.storage_type)
        if not _is_binary(values.type):
            raise TypeError(f"column {column!r} is {values.type}, and not well-known binary")
        return values.to_pylist()

    def attributes(self):
        """Return names and values of the other columns."""
        others = [name for name in self.table.column_names if name not in self.names]
        return {name: values_of(self.table.column(name).to_pylist()) for name in others}

    def moved(self, geometries):
        """Return a table with these geometries, those of each column, and with their bounding boxes."""
        table = self.table
        for name, moved in zip(self.names, geometries):
            position = table.schema.get_field_index(name)
            field = table.schema.field(position)
            table = table.set_column(position, field, _array(moved, field.type))
            table = self._with_bounds(table, name, shapely.bounds(shapely.from_wkb(moved)))
        if self.geo:
            table = table.replace_schema_metadata({**table.schema.metadata, b"geo": json.dumps(self.geo).encode()})
        return table

    def _with_bounds(self, table, name, bounds):
        """Return a table whose metadata and covering column have these bounds of a geometry column."""
        entry = self.geo.get("columns", {}).get(name, {})
        if len(entry.get("bbox", [])) == 4 and not numpy.isnan(bounds).all():
            entry["bbox"] = [*numpy.nanmin(bounds[:, :2], axis=0), *numpy.nanmax(bounds[:, 2:], axis=0)]
        covering = entry.get("covering", {}).get("bbox")
        if covering is None or covering["xmin"][0] not in table.column_names:
            return table
        column = covering["xmin"][0]
        position = table.schema.get_field_index(column)
        field = table.schema.field(position)
        places = {covering[side][1]: number for number, side in enumerate(("xmin", "ymin", "xmax", "ymax"))}
        sides = [_rounded_outward(bounds[:, places[part.name]], part.type, places[part.name] < 2) for part in field.type]
        missing = pyarrow.array(numpy.isnan(bounds[:, 0]))
        boxes = pyarrow.StructArray.from_arrays(sides, fields=list(field.type), mask=missing)
        return table.set_column(position, field, boxes)


def _extension(field):
    """Return the name and the metadata of the extension type of a field."""
    if isinstance(field.type, pyarrow.BaseExtensionType):
        serialized = field.type.__arrow_ext_serialize__() if hasattr(field.type, "__arrow_ext_serialize__") else b""
        return field.type.extension_name, serialized
    metadata = field.metadata or {}
    name = metadata.get(b"ARROW:extension:name", b"").decode()
    return name, metadata.get(b"ARROW:extension:metadata", b"")


def _is_binary(kind):
    types = pyarrow.types
    tests = (types.is_binary, types.is_large_binary, getattr(types, "is_binary_view", lambda kind: False))
    return any(test(kind) for test in tests)


def _array(values, kind):
    if isinstance(kind, pyarrow.BaseExtensionType):
        return pyarrow.ExtensionArray.from_storage(kind, pyarrow.array(values, kind.storage_type))
    return pyarrow.array(values, kind)


def _rounded_outward(values, kind, is_lower):
    """Return sides of boxes that still hold the geometries when they have fewer digits."""
    rounded = values.astype(kind.to_pandas_dtype())
    inside = rounded > values if is_lower else rounded < values
    outward = numpy.nextafter(rounded, numpy.array(-numpy.inf if is_lower else numpy.inf, rounded.dtype))
    return pyarrow.array(numpy.where(inside, outward, rounded), kind)
