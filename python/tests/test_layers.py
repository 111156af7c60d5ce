"""Layers of well-known binary, and what programs make of them: evidence maps, lists of options, digests."""

import json
import struct
import subprocess
import unittest
from xml.etree import ElementTree

import meshmark
import pyogrio
import shapely
from test_marking import FIXTURES, Folder, layers_of, town
from test_verification import COMMAND, marked


def binary(frame):
    """Return a GeoDataFrame as a layer of well-known binary."""
    attributes = {name: frame[name].tolist() for name in frame.columns.drop("geometry")}
    return meshmark.Layer(shapely.to_wkb(frame.geometry.array).tolist(), frame.crs, attributes, frame.index)


class Layers(Folder):
    def mark(self, layers, **options):
        return meshmark.mark(layers, self.key, recipient="ACME GmbH", **options)

    def test_a_layer_is_marked_as_a_frame(self):
        frame = town()
        meant, expected = self.mark(frame)
        given = binary(frame)
        before = list(given.geometries)
        copy, record = self.mark(given)
        self.assertEqual(record, expected)
        self.assertEqual(copy.geometries, shapely.to_wkb(meant.geometry.array).tolist())
        self.assertEqual((copy.crs, copy.attributes, given.geometries), (frame.crs, given.attributes, before))
        self.assertEqual(self.mark({"a": given})[0]["a"].geometries, copy.geometries)

    def test_measures_and_missing_geometries_stay(self):
        frame = town()
        points = [shapely.from_wkt(f"POINT ZM ({20 * n} {n % 7} 3.5 {n}.25)") for n in range(300)]
        given = meshmark.Layer([shapely.to_wkb(point, output_dimension=4, flavor="iso") for point in points], frame.crs)
        given.geometries[7] = None
        copy, _ = self.mark({"houses": binary(frame), "points": given})
        found = copy["points"].geometries
        self.assertIsNone(found[7])
        self.assertEqual([wkb[-16:] for wkb in found if wkb], [wkb[-16:] for wkb in given.geometries if wkb])
        self.assertNotEqual(found, given.geometries)

    def test_curves_are_refused(self):
        frame = town()
        places = struct.pack("<6d", 0, 0, 5, 5, 10, 0)
        arc = struct.pack("<BII", 1, 8, 3) + places
        for wkb in (arc, struct.pack("<BII", 1, 11, 1) + arc):
            with self.assertRaisesRegex(meshmark.MapError, "curved geometries"):
                self.mark({"houses": binary(frame), "curves": meshmark.Layer([wkb], frame.crs)})

    def test_messages_name_features_by_their_ids(self):
        frame = town()
        frame.index = frame.index + 1000
        layer = binary(frame)
        layer.geometries[3] = layer.geometries[3][:-1]
        with self.assertRaisesRegex(meshmark.MapError, "1003"):
            self.mark(layer)

    def test_a_column_of_another_length_is_refused(self):
        with self.assertRaisesRegex(ValueError, "name has 1 values, and there are 2 geometries"):
            meshmark.Layer([None, None], attributes={"name": ["a"]})

    def test_attributes_find_the_place_of_a_moved_layer(self):
        frame = town()
        copy, record = self.mark(binary(frame))
        moved = shapely.transform(shapely.from_wkb(copy.geometries), lambda xy: xy[:, ::-1] * 1.25 + 1000)
        suspect = meshmark.Layer(shapely.to_wkb(moved).tolist(), copy.crs, copy.attributes)
        report = meshmark.verify(suspect, binary(frame), self.key, record)
        self.assertEqual(report.verdict, "match")
        self.assertIn("landmarks", report.registration)


class EvidenceMaps(Folder):
    def test_they_are_those_of_the_command(self):
        source = FIXTURES / "kotka.gpkg"
        layers = layers_of(source)
        copies, record = marked(layers, self.key, recipient="ACME GmbH")
        suspect, written = self.folder / "suspect.gpkg", self.folder / "record.json"
        for name, frame in copies.items():
            frame.iloc[: len(frame) // 2].to_file(suspect, layer=name)
        written.write_text(record.to_json())
        self.key.write(self.folder / "key.json")
        for is_exact in (False, True):
            file = self.folder / f"evidence{is_exact}.gpkg"
            command = [COMMAND, "verify", "--key", self.folder / "key.json", "--record", written, "--reference", source]
            command += ["--evidence-map", file, *(["--exact-displacements"] if is_exact else []), suspect]
            subprocess.run(command, check=True, capture_output=True)
            report = meshmark.verify(
                layers_of(suspect), layers, self.key, record, evidence_map=True, exact_displacements=is_exact
            )
            found = meshmark.evidence_map(report)
            self.assertEqual(list(found), pyogrio.list_layers(file)[:, 0].tolist())
            for name, frame in layers_of(file).items():
                self.assertEqual(found[name].geometries, shapely.to_wkb(frame.geometry.array).tolist(), name)
                self.assertTrue(frame.crs.equals(found[name].crs))
                for column in frame.columns.drop("geometry"):
                    own = [value if value is not None else float("nan") for value in found[name].attributes[column]]
                    meant = [value if value is not None else float("nan") for value in frame[column].tolist()]
                    self.assertEqual(str(own), str(meant), (name, column))

    def test_a_report_without_one_says_so(self):
        frame = town()
        copy, record = meshmark.mark(frame, self.key, recipient="ACME GmbH")
        with self.assertRaisesRegex(ValueError, "evidence_map=True"):
            meshmark.evidence_map(meshmark.verify(copy, frame, self.key, record))


class ForPrograms(Folder):
    def test_the_list_has_every_option_of_mark(self):
        listed = ElementTree.fromstring(meshmark.creation_option_list())
        names = {option.get("name").lower() for option in listed}
        for name in ("recipient", "message", "srs", *meshmark._options.OPTIONS):
            self.assertIn(name, names)
        self.assertTrue(all(option.get("description") for option in listed))

    def test_a_record_takes_the_digests_of_files(self):
        frame = town()
        _, record = meshmark.mark(frame, self.key, recipient="ACME GmbH")
        with_digests = json.loads(record.with_file_digests("12" * 32, "34" * 32).to_json())
        self.assertEqual(with_digests["reference"].pop("file_sha256"), "12" * 32)
        self.assertEqual(with_digests["copy"].pop("file_sha256"), "34" * 32)
        without = json.loads(record.to_json())
        without["reference"].pop("file_sha256"), without["copy"].pop("file_sha256")
        self.assertEqual(with_digests, without)
        _, message = marked(frame, self.key, message="0011223344556677")
        self.assertEqual(message.with_file_digests("12" * 32), message)


if __name__ == "__main__":
    unittest.main()
