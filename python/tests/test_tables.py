"""Tables with the Arrow interface."""

import json
import pathlib
import tempfile
import unittest

import geopandas
import meshmark
import pyarrow
import pyarrow.parquet
import shapely
from test_marking import town


class Tables(unittest.TestCase):
    def setUp(self):
        self.key = meshmark.Key.generate()
        self.frame = town()
        self.meant, self.record = self.mark(self.frame)

    def mark(self, layers, **options):
        return meshmark.mark(layers, self.key, recipient="ACME GmbH", **options)

    def assert_marked(self, table, record=None):
        found = shapely.from_wkb(table.column("geometry").to_pylist())
        self.assertTrue((shapely.to_wkb(found) == self.meant.geometry.to_wkb()).all())
        self.assertTrue(table.column("number").to_pylist() == self.frame.number.tolist())
        self.assertEqual(record or self.record, self.record)

    def test_a_column_that_its_metadata_call_a_geometry(self):
        table = pyarrow.table(self.frame.to_arrow(geometry_encoding="WKB", index=False))
        copy, record = self.mark(table)
        self.assert_marked(copy, record)
        self.assertEqual(copy.schema, table.schema)
        self.assertTrue(copy.schema.field("geometry").metadata == table.schema.field("geometry").metadata)

    def test_a_column_that_is_named(self):
        for kind in (pyarrow.binary(), pyarrow.large_binary()):
            wkb = pyarrow.array(self.frame.geometry.to_wkb(), kind)
            table = pyarrow.table({"number": self.frame.number.tolist(), "geometry": wkb})
            copy, _ = self.mark(table, geometry="geometry", srs="EPSG:3067")
            self.assert_marked(copy)
            self.assertEqual(copy.schema, table.schema)

    def test_no_column_of_geometries_is_left_out(self):
        table = pyarrow.table(self.frame.to_arrow(geometry_encoding="WKB", index=False))
        second = table.append_column("second", pyarrow.array(self.frame.geometry.to_wkb(), pyarrow.binary()))
        copy, _ = self.mark(second, geometry="second", srs="EPSG:3067")
        self.assert_marked(copy)
        self.assertEqual(copy.column("second").to_pylist(), copy.column("geometry").to_pylist())

    def test_geoparquet_keeps_its_metadata_and_its_boxes_hold(self):
        self.frame.loc[3, "geometry"] = None
        self.meant, self.record = self.mark(self.frame)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "town.parquet"
            self.frame.to_parquet(path, write_covering_bbox=True, index=False)
            table = pyarrow.parquet.read_table(path)
            singles = pyarrow.struct([(side, pyarrow.float32()) for side in ("xmin", "ymin", "xmax", "ymax")])
            position = table.schema.get_field_index("bbox")
            table = table.set_column(position, pyarrow.field("bbox", singles), table.column("bbox").cast(singles))
            copy, record = self.mark(table)
            pyarrow.parquet.write_table(copy, path)
            read = geopandas.read_parquet(path)
        self.assertEqual(record, self.record)
        self.assertEqual(read.crs, self.frame.crs)
        self.assertTrue(read.geometry.drop(3).geom_equals_exact(self.meant.geometry.drop(3), 0).all())
        boxes, bounds = copy.column("bbox").to_pylist(), read.bounds
        self.assertIsNone(boxes[3])
        for number in bounds.index.drop(3):
            box, (xmin, ymin, xmax, ymax) = boxes[number], bounds.loc[number]
            self.assertTrue(box["xmin"] <= xmin and box["ymin"] <= ymin)
            self.assertTrue(box["xmax"] >= xmax and box["ymax"] >= ymax)
            self.assertLess(box["xmax"] - xmax, 1)
        geo = json.loads(copy.schema.metadata[b"geo"])["columns"]["geometry"]
        self.assertEqual(geo["bbox"], list(read.total_bounds))

    def test_what_is_no_table_of_well_known_binary_is_named(self):
        table = pyarrow.table({"number": [1], "place": [2.0]})
        with self.assertRaisesRegex(TypeError, "no column that its metadata call a geometry"):
            self.mark(table)
        with self.assertRaisesRegex(TypeError, "not one column 'geom': it has number, place"):
            self.mark(table, geometry="geom")
        with self.assertRaisesRegex(TypeError, "'place' is double, and not well-known binary"):
            self.mark(table, geometry="place")
        native = pyarrow.table(self.frame.to_arrow(geometry_encoding="geoarrow", index=False))
        with self.assertRaisesRegex(TypeError, "'geometry' .* geoarrow.polygon, and would not be marked"):
            self.mark(native)
        broken = pyarrow.table({"geometry": [b"\x01\x02"]})
        with self.assertRaisesRegex(meshmark.MapError, 'layer "layer", feature 0: .*ends in the middle'):
            self.mark(broken, geometry="geometry")


if __name__ == "__main__":
    unittest.main()
