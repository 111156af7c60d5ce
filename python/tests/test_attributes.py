"""Attributes as texts: those that GDAL reads from a file."""

import unittest

import numpy
import pandas

from meshmark._attributes import texts_of, values_of, values_of_series


class Attributes(unittest.TestCase):
    def check(self, column, expected):
        self.assertEqual(values_of_series(pandas.Series(column)), expected)

    def test_strings_integers_and_truth_values_are_texts(self):
        self.check(["a", None, ""], ["a", None, ""])
        self.check([1, 2**62], ["1", str(2**62)])
        self.check(pandas.Series([1, None], dtype="Int64"), ["1", None])
        self.check([True, False], ["1", "0"])
        self.check(pandas.Series(["a", "b"], dtype="category"), ["a", "b"])
        self.assertEqual(values_of([numpy.bool_(True), numpy.int8(7)]), ["1", "7"])

    def test_floats_are_integers_where_some_are_missing_and_no_other_has_a_fraction(self):
        self.check([1.0, numpy.nan], ["1", None])
        self.check([1.5, numpy.nan], [None, None])
        self.check([1.0, 2.0], [None, None])
        self.check([1.0, numpy.inf, numpy.nan], [None, None, None])
        self.check([1e300, numpy.nan], [None, None])
        self.assertEqual(values_of([1.0, None]), [None, None])

    def test_other_values_are_none(self):
        self.check(pandas.to_datetime(["2026-11-28"]), [None])
        self.check([{"a": 1}, [2]], [None, None])
        self.check([numpy.nan, numpy.nan], [None, None])

    def test_a_feature_has_the_texts_of_the_wanted_columns_in_their_order(self):
        columns = {"Name": ["a", None], "number": ["1", "2"]}
        self.assertEqual(texts_of(columns, 2), [["a", "1"], ["2"]])
        self.assertEqual(texts_of(columns, 2, {"name"}), [["a"], []])
        self.assertEqual(texts_of({}, 2), [[], []])


if __name__ == "__main__":
    unittest.main()
