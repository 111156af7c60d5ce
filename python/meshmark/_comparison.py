"""Comparison."""

import math
import numbers
from typing import Any, Optional

from . import _geos, _meshmark
from ._layers import maps_of
from ._options import check_kind, check_run, check_switches


def compare(
    reference: Any,
    marked: Any,
    *,
    precision: Optional[float] = None,
    exact_displacements: bool = False,
    geometry: Optional[str] = None,
    threads: Optional[int] = None,
) -> _meshmark.Comparison:
    """Measure the effect of marking on a map: displacement, angles, areas, topology.

    Features correspond by their order in each layer, vertices by their order in each feature.

    Parameters
    ----------
    reference : geopandas.GeoDataFrame, array of shapely's geometries, Layer, table, or dict of str to these
        The map as it was before marking.
    marked : the same
        The marked map.
    precision : float, optional
        Grid of the marked map, CRS units: overlaps up to a cell of it count as slivers.
    exact_displacements : bool
        Whether the result has exact displacements of vertices; it is then to be kept as secret as the records.
    geometry : str, optional
        The geometry column of those tables whose metadata name none; other layers have their own.
    threads : int, optional
        The number of threads; all processors by default. It changes no result.

    Returns
    -------
    comparison : Comparison
        The figures and the page of ``meshmark compare``.

    Raises
    ------
    MapError
        When a map cannot be read, or the two do not correspond.
    OptionError
        When `precision` is not greater than 0.

    Examples
    --------
    >>> import geopandas, meshmark, shapely
    >>> houses = [shapely.box(20 * x, 20 * y, 20 * x + 9 + (x * y) % 5, 20 * y + 8) for x in range(20) for y in range(20)]
    >>> town = geopandas.GeoDataFrame(geometry=houses, crs="EPSG:3067")
    >>> copy, record = meshmark.mark(town, meshmark.Key.generate(), recipient="ACME GmbH")
    >>> 0.01 < meshmark.compare(town, copy).rms_m < 0.2
    True
    """
    check_run(threads)
    check_kind("precision", precision, (numbers.Real, type(None)), "a number")
    check_switches({"exact_displacements": exact_displacements})
    if precision is not None and not 0 < precision < math.inf:
        raise _meshmark.OptionError(f"precision={precision} is not legal: give a number greater than 0")
    settings = {"precision": precision, "exact_displacements": exact_displacements, "threads": threads}
    maps = maps_of([reference, marked], geometry)
    return _meshmark.compare(*maps, _geos, settings)
