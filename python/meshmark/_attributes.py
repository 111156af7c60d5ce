"""The attributes of features as texts, by which a verification finds places, as GDAL would read them from a file."""

import numbers

import numpy


def values_of(column):
    """Return the texts of strings, integers and truth values; None for all other values."""
    return [_text(value) for value in column]


def values_of_series(series):
    """Return the texts of a series of pandas, which keeps integers as floats where some are missing."""
    if series.dtype.kind == "f" and series.hasnans:
        there = series.dropna()
        if (there % 1 == 0).all() and (there.abs() < 2**63).all():
            series = series.astype("Int64")
    return values_of(series.to_numpy(dtype=object, na_value=None))


def texts_of(columns, count, wanted=None):
    """Return the texts of each of so many features, from columns of these names or from all."""
    if wanted is not None:
        columns = {name: values for name, values in columns.items() if name.lower() in wanted}
    rows = zip(*columns.values()) if columns else ((),) * count
    return [[text for text in row if text is not None] for row in rows]


def _text(value):
    if isinstance(value, str):
        return value
    return str(int(value)) if isinstance(value, (numbers.Integral, numpy.bool_)) else None
