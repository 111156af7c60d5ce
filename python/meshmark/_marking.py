"""Marking."""

import warnings
from collections.abc import Callable
from typing import Any, Optional

from . import _geos, _meshmark
from ._layers import Sources
from ._options import check_key, check_options, check_run, option_pairs


def mark(
    layers: Any,
    key: _meshmark.Key,
    *,
    recipient: Optional[str] = None,
    message: Optional[str] = None,
    srs: Optional[str] = None,
    geometry: Optional[str] = None,
    threads: Optional[int] = None,
    progress: Optional[Callable[[int, int], object]] = None,
    **options: Any,
) -> tuple[Any, _meshmark.Record]:
    """Mark a map.

    Parameters
    ----------
    layers : geopandas.GeoDataFrame, array of shapely's geometries, Layer, table, or dict of str to these
        The map; several layers share one mesh, and one CRS. A table is any object with the Arrow
        interface, whose geometry columns are well-known binary.
    key : Key
        The secret key.
    recipient : str, optional
        The recipient of the copy, whose fingerprint it gets.
    message : str, optional
        A message instead, hexadecimal.
    srs : str, optional
        The CRS of layers that have none, such as "EPSG:3067".
    geometry : str, optional
        The geometry column of tables whose metadata name none.
    threads : int, optional
        The number of threads; all processors by default. It changes no result.
    progress : callable, optional
        Called with the number of patches done and of all patches. With tqdm:
        ``bar = tqdm(); mark(..., progress=lambda done, all: (bar.reset(all), bar.update(done)))``.
    **options
        ``amplitude`` (metres RMS), ``tolerance`` (metres), ``precision`` (CRS units), ``patch_size``,
        ``part_size``, ``shape``, ``basis``, and for messages ``code`` and ``chip_rate``, as the driver has them.

    Returns
    -------
    layers : what was given
        A marked copy; what was given is unchanged. Tables become tables of pyarrow.
    record : Record
        The record, which an auditor needs besides the key and the unmarked map.

    Raises
    ------
    MapError
        When the map cannot be marked: too few vertices, degrees without a CRS, several CRSs.
    OptionError
        When an option has a value that is not legal.
    """
    check_options("mark", options)
    if (recipient is None) == (message is None):
        raise TypeError("mark() needs a recipient or a message, and not both")
    check_key(key)
    check_run(threads, progress)
    pairs = option_pairs({"srs": srs}, options)
    subject = option_pairs({"recipient": recipient, "message": message}, {})
    for text in _meshmark.check_recipients([name for option, name in subject if option == "RECIPIENT"]):
        warnings.warn(text, stacklevel=2)
    map = Sources(layers, geometry)
    settings = {"threads": threads, "progress": progress}
    [(moved, record)], texts = _meshmark.mark(map.columns, key, pairs, subject, _geos, settings)
    for text in texts:
        warnings.warn(text, stacklevel=2)
    return map.moved(moved), record
