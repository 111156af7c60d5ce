"""Marking."""

import warnings

import pyproj

from . import _frames, _geos, _meshmark
from ._crs import Crs

# The options of the driver that shape a mark.
OPTIONS = (
    "amplitude",
    "basis",
    "chip_rate",
    "code",
    "patch_size",
    "precision",
    "shape",
    "tolerance",
)


def mark(layers, key, *, recipient=None, message=None, srs=None, threads=None, progress=None, **options):
    """Mark a map.

    Parameters
    ----------
    layers : geopandas.GeoDataFrame or dict of str to GeoDataFrame
        The map; several layers share one mesh, and one CRS.
    key : Key
        The secret key.
    recipient : str, optional
        The recipient of the copy, whose fingerprint it gets.
    message : str, optional
        A message instead, hexadecimal.
    srs : str, optional
        The CRS of layers that have none, such as "EPSG:3067".
    threads : int, optional
        The number of threads; all processors by default. It changes no result.
    progress : callable, optional
        Called with the number of patches done and of all patches. With tqdm:
        ``bar = tqdm(); mark(..., progress=lambda done, all: (bar.reset(all), bar.update(done)))``.
    **options
        ``amplitude`` (metres RMS), ``tolerance`` (metres), ``precision`` (CRS units), ``patch_size``,
        ``shape``, ``basis``, and for messages ``code`` and ``chip_rate``, as the driver has them.

    Returns
    -------
    layers : geopandas.GeoDataFrame or dict of str to GeoDataFrame
        A marked copy; what was given is unchanged.
    record : Record
        The record, which an auditor needs besides the key and the unmarked map.

    Raises
    ------
    MapError
        When the map cannot be marked: too few vertices, degrees without a CRS, several CRSs.
    OptionError
        When an option has a value that is not legal.
    """
    frames = _as_dict(layers)
    given = {"recipient": recipient, "message": message, "srs": srs, **options}
    unknown = sorted(set(options) - set(OPTIONS))
    if unknown:
        raise TypeError(f"mark() has no option {unknown[0]}: use {', '.join(OPTIONS)}")
    if (recipient is None) == (message is None):
        raise TypeError("mark() needs a recipient or a message, and not both")
    if threads is not None and not 1 <= threads <= 256:
        raise ValueError(f"threads={threads} is not a whole number from 1 to 256")
    pairs = [(name.upper(), str(value)) for name, value in given.items() if value is not None]
    moved, record, texts = _meshmark.mark(
        _frames.layers_of(frames),
        key,
        pairs,
        _geos,
        {"srs": srs and _crs_of(srs), "threads": threads, "progress": progress},
    )
    for text in texts:
        warnings.warn(text, stacklevel=2)
    copies = _frames.moved(frames, moved)
    return (copies if isinstance(layers, dict) else copies["layer"]), record


def _crs_of(srs):
    try:
        return Crs(srs)
    except pyproj.exceptions.CRSError:
        text = f"srs={srs} is not a CRS that PROJ knows: use for example EPSG:3067"
        raise _meshmark.OptionError(text) from None


def _as_dict(layers):
    frames = layers if isinstance(layers, dict) else {"layer": layers}
    for name, frame in frames.items():
        if not hasattr(frame, "geometry") or not hasattr(frame, "crs"):
            raise TypeError(
                f"layer {name!r} is a {type(frame).__name__}, and not a GeoDataFrame: make one with "
                "geopandas.GeoDataFrame(..., geometry=..., crs=...)"
            )
    return frames
