"""Verification."""

import numbers
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Optional, Union

from . import _meshmark
from ._layers import maps_of
from ._options import check_key, check_kind, check_options, check_run, check_switches, option_pairs


def verify(
    suspect: Any,
    reference: Any,
    key: _meshmark.Key,
    record: Optional[_meshmark.Record] = None,
    *,
    records: Union[Sequence[_meshmark.Record], Mapping[str, _meshmark.Record], None] = None,
    recipient: Optional[str] = None,
    message: Optional[str] = None,
    srs: Optional[str] = None,
    geometry: Optional[str] = None,
    landmarks: Optional[Sequence[str]] = None,
    registration: str = "auto",
    demodulator: str = "joint",
    radius: Optional[float] = None,
    significance: float = 1e-6,
    evidence_map: bool = False,
    exact_displacements: bool = False,
    show_recipients: bool = False,
    threads: Optional[int] = None,
    progress: Optional[Callable[[str, int, int], object]] = None,
    **options: Any,
) -> _meshmark.Report:
    """Determine whether a suspect map carries a mark, and whose.

    Parameters
    ----------
    suspect : geopandas.GeoDataFrame, array of shapely's geometries, Layer, table, or dict of str to these
        The map in question, in any CRS, or without one.
    reference : the same, or a list of these
        The map as it was before marking; several, such as editions, where records choose among them.
    key : Key
        The secret key.
    record : Record, optional
        The record of the copy that the suspect may be. Without one, all options that differed from the
        defaults are needed.
    records : list of Record, or dict of str to Record, optional
        The records of all copies, to find the recipient; the names are those in the report.
    recipient, message : str, optional
        Whose copy it may be, or its message, where there is no record.
    srs : str, optional
        The CRS of a reference that has none, such as "EPSG:3067".
    geometry : str, optional
        The geometry column of those tables whose metadata name none; other layers have their own.
    landmarks : list of str, optional
        Columns of the reference to find places by, which have equal values in any column of the suspect;
        all columns of texts and integers by default.
    registration : {"auto", "landmarks", "geometry", "none"}
        How to bring the suspect onto the reference.
    demodulator : {"joint", "paper"}
        How to demodulate; "paper" is the detector of Ohbuchi, Ueda and Endoh, for messages.
    radius : float, optional
        Radius within which vertices match, metres on the ground; by default it follows from the suspect.
    significance : float
        The verdict is a match when the p-value is below this.
    evidence_map : bool
        Whether the function `evidence_map` gives the evidence of the report as layers.
    exact_displacements : bool
        Whether the report has exact displacements of vertices; it is then to be kept as secret as the records.
    show_recipients : bool
        Whether the report names the recipients of records that were tried and do not match.
    threads : int, optional
        The number of threads; all processors by default. It changes no result.
    progress : callable, optional
        Called with the name of the stage, the number of its steps done, and of all its steps (0: unknown).
    **options
        How the map was marked, where there is no record: the options of `mark`.

    Returns
    -------
    report : Report
        The report of ``meshmark verify``: its verdict, its JSON and its page.

    Raises
    ------
    MapError
        When a map cannot be read or compared.
    RecordError
        When the record is not of this key and this reference.
    OptionError
        When an option has a value that is not legal, or contradicts the record.

    Examples
    --------
    >>> import geopandas, meshmark, shapely
    >>> houses = [shapely.box(20 * x, 20 * y, 20 * x + 9 + (x * y) % 5, 20 * y + 8) for x in range(20) for y in range(20)]
    >>> town = geopandas.GeoDataFrame(geometry=houses, crs="EPSG:3067")
    >>> key = meshmark.Key.generate()
    >>> copy, record = meshmark.mark(town, key, recipient="ACME GmbH")
    >>> report = meshmark.verify(copy.to_crs("EPSG:4326"), town, key, record)
    >>> report.verdict, report.recipient
    ('match', 'ACME GmbH')
    """
    check_options("verify", options)
    check_key(key)
    check_run(threads, progress)
    records = _listed(records)
    _check_records(record, records)
    if isinstance(landmarks, str):
        raise TypeError(f"landmarks is the text {landmarks!r}, and not a list of texts: use [{landmarks!r}]")
    for name, word in {"registration": registration, "demodulator": demodulator}.items():
        check_kind(name, word, (str,), "a text")
    check_kind("significance", significance, (numbers.Real,), "a number")
    check_kind("radius", radius, (numbers.Real, type(None)), "a number")
    switches = {"evidence_map": evidence_map, "exact_displacements": exact_displacements}
    check_switches({**switches, "show_recipients": show_recipients})
    pairs = option_pairs({"recipient": recipient, "message": message, "srs": srs}, options)
    if records is not None and (record is not None or pairs):
        given = "record" if record is not None else pairs[0][0].lower()
        raise TypeError(f"verify() takes records or {given}, and not both")
    references = list(reference) if isinstance(reference, (list, tuple)) else [reference]
    if not references:
        raise TypeError("verify() needs a reference: the map as it was before marking")
    fields = None if landmarks is None else {name.lower() for name in landmarks}
    suspect, *maps = maps_of([suspect, *references], geometry, fields)
    for name in landmarks or ():
        _check_field(name, maps)
    sought = {"options": pairs, "record": record, "records": _named(records)}
    settings = {
        "registration": registration,
        "demodulator": demodulator,
        "radius": radius,
        "significance": significance,
        "evidence_map": evidence_map,
        "exact_displacements": exact_displacements,
        "show_recipients": show_recipients,
        "threads": threads,
        "progress": progress,
    }
    compared = {"suspect": suspect, "references": maps}
    return _meshmark.verify(compared, key, sought, settings)


def _named(records):
    """Return names and records, in the order of the names."""
    if records is None:
        return None
    if isinstance(records, Mapping):
        return sorted(records.items())
    digits = len(str(len(records)))
    return [(f"record {number:0{digits}}", record) for number, record in enumerate(records, 1)]


def _listed(records):
    """Return records that may be iterated over several times."""
    is_list = isinstance(records, Iterable) and not isinstance(records, (str, bytes, Mapping))
    return list(records) if is_list else records


def _check_records(record, records):
    """Raise for what are no records."""
    read = "read one with meshmark.Record.read"
    if record is not None and not isinstance(record, _meshmark.Record):
        raise TypeError(f"record is {record!r}, a {type(record).__name__}, and not a Record: {read}")
    if not isinstance(records, (list, Mapping, type(None))):
        raise TypeError(f"records is {records!r}, a {type(records).__name__}, and not a list or dict of Record: {read}")
    names, values = (records.keys(), records.values()) if isinstance(records, Mapping) else ((), records or ())
    for name in names:
        check_kind("a name in records", name, (str,), "a text")
    for value in values:
        if not isinstance(value, _meshmark.Record):
            raise TypeError(f"records has {value!r}, a {type(value).__name__}, and not a Record: {read}")


def _check_field(name, maps):
    """Raise for a misspelt field, which would silently give no landmark."""
    for map in maps:
        if name.lower() not in {field.lower() for field in map.fields}:
            known = ", ".join(sorted(map.fields))
            raise _meshmark.OptionError(f'the reference has no field "{name}": landmarks may name {known}')
