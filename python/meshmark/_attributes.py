"""The attributes of features as texts, by which a verification finds places, as GDAL would read them from a file."""

import numbers


def values_of(column):
    """Return the texts of a column: of strings, integers and truth values; None for all others."""
    column = list(column)
    # Pandas keeps integers as floats where some are missing.
    are_integers = any(_is_missing(value) for value in column) and all(
        _is_missing(value) or isinstance(value, numbers.Real) and value == int(value) for value in column if _is_finite(value)
    )
    return [_text(value, are_integers) for value in column]


def texts_of(columns, count, wanted=None):
    """Return the texts of each of so many features, from columns of these names or from all."""
    if wanted is not None:
        columns = {name: values for name, values in columns.items() if name.lower() in wanted}
    rows = zip(*columns.values()) if columns else ((),) * count
    return [[text for text in row if text is not None] for row in rows]


def _text(value, are_integers):
    if isinstance(value, str):
        return value
    if isinstance(value, numbers.Integral) or type(value).__name__ == "bool_":
        return str(int(value))
    if are_integers and isinstance(value, numbers.Real) and _is_finite(value):
        return str(int(value))
    return None


def _is_missing(value):
    return value is None or value != value or type(value).__name__ in ("NAType", "NaTType")


def _is_finite(value):
    return isinstance(value, numbers.Real) and value == value and abs(value) != float("inf")
