"""Comparison: the figures and the page of the command, bit for bit."""

import json
import subprocess
import unittest

import meshmark
import shapely
import shapely.affinity

from test_marking import FIXTURES, Folder, layers_of, town
from test_verification import COMMAND, marked, sections_of


class Comparisons(Folder):
    def test_figures_and_page_of_the_command(self):
        source, copy = FIXTURES / "kotka.gpkg", self.folder / "copy.gpkg"
        layers = layers_of(source)
        for name, frame in marked(layers, self.key, recipient="ACME GmbH")[0].items():
            frame.to_file(copy, layer=name, driver="GPKG")
        compared = meshmark.compare(layers, layers_of(copy))
        for ending in ("json", "html"):
            file = self.folder / f"report.{ending}"
            command = [COMMAND, "compare", "--report", file, source, copy]
            text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        self.assertEqual(str(compared), text)
        expected = json.loads((self.folder / "report.json").read_text())
        expected["detail"]["provenance"] = None
        self.assertEqual(json.dumps(compared.to_dict()), json.dumps(expected))
        own, theirs = (sections_of(page) for page in (compared.to_html(), (self.folder / "report.html").read_text()))
        shared = [title for title in own if title in theirs]
        self.assertGreaterEqual(len(shared), 4)
        self.assertEqual([own[title] for title in shared], [theirs[title] for title in shared])

    def test_maps_that_do_not_correspond_are_refused(self):
        reference = town()
        with self.assertRaisesRegex(meshmark.MapError, "400 geometries and the marked map 399"):
            meshmark.compare(reference, reference.iloc[:-1])
        other = reference.copy()
        other.loc[5, "geometry"] = shapely.Point(0, 0)
        with self.assertRaisesRegex(meshmark.MapError, 'layer "layer", feature 5 of the reference'):
            meshmark.compare(reference, other)
        with self.assertRaisesRegex(meshmark.MapError, "in EPSG:3857 and the reference in EPSG:3067"):
            meshmark.compare(reference, reference.to_crs("EPSG:3857"))

    def test_layers_correspond_by_name_or_are_the_only_ones(self):
        reference = town()
        other = {"houses": reference}
        self.assertEqual(meshmark.compare(reference, other).max_m, 0.0)
        roads = reference.geometry.boundary.to_frame("geometry")
        for marked in ({"houses": reference, "roads": roads}, {"roads": roads, "houses": reference}):
            self.assertEqual(meshmark.compare({"houses": reference, "roads": roads}, marked).max_m, 0.0)
        with self.assertRaisesRegex(meshmark.MapError, 'only the reference has "roads", only the marked map has "streets"'):
            meshmark.compare({"houses": reference, "roads": roads}, {"houses": reference, "streets": roads})
        with self.assertRaisesRegex(meshmark.MapError, '400 geometries in layer "roads" and the marked map 399'):
            meshmark.compare({"houses": reference, "roads": roads}, {"houses": reference, "roads": roads.iloc[1:]})

    def test_arguments_that_are_refused(self):
        reference = town()
        for precision in (0, -1, float("nan"), float("inf")):
            with self.assertRaisesRegex(meshmark.OptionError, "precision=.* is not legal: give a number greater than 0"):
                meshmark.compare(reference, reference, precision=precision)
        with self.assertRaisesRegex(TypeError, "precision is '1', a str, and not a number"):
            meshmark.compare(reference, reference, precision="1")
        degrees = shapely.affinity.scale
        small = reference.geometry.set_crs(None, allow_override=True).apply(lambda house: degrees(house, 1e-3, 1e-3, origin=(0, 0)))
        with self.assertRaises(meshmark.MapError) as refused:
            meshmark.compare(small, small)
        self.assertRegex(str(refused.exception), "the reference: it has no CRS .*: give it its CRS")
        self.assertNotIn("srs", str(refused.exception))

    def test_a_page_for_a_notebook(self):
        reference = town()
        same = meshmark.compare(reference, reference, exact_displacements=True)
        self.assertEqual((same.rms_m, same.max_m), (0.0, 0.0))
        self.assertEqual(repr(same), "<meshmark.Comparison 0.000 m RMS, at most 0.000 m>")
        self.assertTrue(same._repr_html_().startswith("<iframe srcdoc="))


if __name__ == "__main__":
    unittest.main()
