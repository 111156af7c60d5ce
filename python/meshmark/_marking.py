"""Marking."""

import warnings
from collections.abc import Callable
from typing import Any, Optional

import pyproj

from . import _geos, _meshmark
from ._crs import Crs
from ._layers import source

# The options of the driver that shape a mark.
OPTIONS = (
    "amplitude",
    "basis",
    "chip_rate",
    "code",
    "part_size",
    "patch_size",
    "precision",
    "shape",
    "tolerance",
)


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
    layers : geopandas.GeoDataFrame, array of shapely's geometries, table, or dict of str to these
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
    unknown = sorted(set(options) - set(OPTIONS))
    if unknown:
        raise TypeError(f"mark() has no option {unknown[0]}: use {', '.join(OPTIONS)}")
    if (recipient is None) == (message is None):
        raise TypeError("mark() needs a recipient or a message, and not both")
    for name, text in (("recipient", recipient), ("message", message), ("srs", srs)):
        if text is not None and not isinstance(text, str):
            raise TypeError(f"{name} is {text!r}, a {type(text).__name__}, and not a text")
    if threads is not None and not 1 <= threads <= 256:
        raise ValueError(f"threads={threads} is not a whole number from 1 to 256")
    texts = {"recipient": recipient, "message": message, "srs": srs, **options}
    pairs = [(name.upper(), str(value)) for name, value in texts.items() if value is not None]
    given = layers if isinstance(layers, dict) else {"layer": layers}
    sources = {name: source(name, layer, geometry) for name, layer in given.items()}
    columns = [column for layer in sources.values() for column in layer.columns]
    settings = {"srs": srs and _crs_of(srs), "threads": threads, "progress": progress}
    moved, record, texts = _meshmark.mark(columns, key, pairs, _geos, settings)
    for text in texts:
        warnings.warn(text, stacklevel=2)
    moved = iter(moved)
    copies = {name: layer.moved([next(moved) for _ in layer.columns]) for name, layer in sources.items()}
    return (copies if isinstance(layers, dict) else copies["layer"]), record


def _crs_of(srs):
    try:
        return Crs(srs)
    except pyproj.exceptions.CRSError:
        text = f"srs={srs} is not a CRS that PROJ knows: use for example EPSG:3067"
        raise _meshmark.OptionError(text) from None
