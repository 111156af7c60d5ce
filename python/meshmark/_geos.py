"""What GEOS decides about geometries, well-known binary, as the extension asks it."""

import shapely

from . import _meshmark

# The codes of the types with arcs: circular string, compound curve, curve polygon, multicurve, multisurface,
# curve, surface (ISO 13249-3).
CURVED = range(8, 15)


def are_valid(geometries):
    """Return which geometries are valid; what is no geometry is not."""
    return shapely.is_valid(_read(geometries)).tolist()


def intersections(ones, others):
    """Return the intersection of each pair."""
    return shapely.to_wkb(shapely.intersection(_read(ones), _read(others)), output_dimension=2).tolist()


def _read(geometries):
    try:
        found = shapely.from_wkb(geometries, on_invalid="ignore")
    except NotImplementedError:
        # Later versions raise for one of many.
        found = [None] * len(geometries)
    if any(read is None and _type(wkb) in CURVED for read, wkb in zip(found, geometries)):
        raise _meshmark.MapError(
            "the map has curved geometries, which shapely does not hold: use the GDAL driver or the command, or replace "
            "the curves by lines first"
        )
    return found


def _type(wkb):
    """Return the code of a type, without heights and measures."""
    return int.from_bytes(wkb[1:5], "little" if wkb[0] else "big") % 1000
