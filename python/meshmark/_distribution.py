"""Distribution."""

import warnings
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Optional

from . import _geos, _meshmark
from ._layers import Sources
from ._options import check_key, check_options, check_run, option_pairs

# So many copies are in memory at once.
BATCH = 16


def distribute(
    layers: Any,
    key: _meshmark.Key,
    recipients: Iterable[str],
    *,
    srs: Optional[str] = None,
    geometry: Optional[str] = None,
    threads: Optional[int] = None,
    progress: Optional[Callable[[int, int], object]] = None,
    **options: Any,
) -> Iterator[tuple[str, Any, _meshmark.Record]]:
    """Mark a map for many recipients, each of whom gets the very copy that `mark` makes.

    The map is solved once for every 16 recipients, whose copies are in memory together.

    Parameters
    ----------
    layers : geopandas.GeoDataFrame, array of shapely's geometries, Layer, table, or dict of str to these
        The map, which must not be changed before the last copy is there.
    key : Key
        The secret key.
    recipients : iterable of str
        The recipients, each named once.
    srs, geometry, threads, progress, **options
        As of `mark`.

    Returns
    -------
    copies : iterator of (str, layers, Record)
        Every recipient with the marked copy and its record.

    Raises
    ------
    MapError
        When the map cannot be marked.
    OptionError
        When an option or a recipient is not legal.

    Examples
    --------
    >>> import geopandas, meshmark, shapely
    >>> houses = [shapely.box(20 * x, 20 * y, 20 * x + 9 + (x * y) % 5, 20 * y + 8) for x in range(20) for y in range(20)]
    >>> town = geopandas.GeoDataFrame(geometry=houses, crs="EPSG:3067")
    >>> key = meshmark.Key.generate()
    >>> copies = list(meshmark.distribute(town, key, ["ACME GmbH", "Example Ltd"]))
    >>> meshmark.verify(copies[1][1], town, key, records=[record for _, _, record in copies]).recipient
    'Example Ltd'
    """
    check_options("distribute", options)
    check_key(key)
    check_run(threads, progress)
    if isinstance(recipients, str):
        raise TypeError(f"recipients is the text {recipients!r}, and not a list of texts: use [{recipients!r}]")
    recipients = list(recipients)
    subjects = [pair for name in recipients for pair in option_pairs({"recipient": name}, {})]
    if len(subjects) < len(recipients):
        raise TypeError("a recipient is None, and not a text")
    twice = [name for number, name in enumerate(recipients) if name in recipients[:number]]
    if twice:
        raise ValueError(f"recipient {twice[0]!r} is named twice: name every recipient once")
    for text in _meshmark.check_recipients([name for _, name in subjects]):
        warnings.warn(text, stacklevel=2)
    pairs = option_pairs({"srs": srs}, options)
    map = Sources(layers, geometry)
    settings = {"threads": threads, "progress": progress}
    return _copies(map, key, (pairs, subjects), settings)


def _copies(map, key, given, settings):
    pairs, subjects = given
    for first in range(0, len(subjects), BATCH):
        batch = subjects[first : first + BATCH]
        copies, texts = _meshmark.mark(map.columns, key, pairs, batch, _geos, settings)
        if first == 0:
            for text in texts:
                warnings.warn(text, stacklevel=2)
        for (_, recipient), (moved, record) in zip(batch, copies):
            yield recipient, map.moved(moved), record
