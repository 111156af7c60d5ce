"""Verification: the report of the command, bit for bit, and what is refused."""

import json
import os
import pathlib
import re
import signal
import subprocess
import time
import unittest
import warnings

import meshmark
import numpy
import pyarrow
import shapely

from test_marking import FIXTURES, PLUGINS, ROOT, Folder, layers_of, town

COMMAND = ROOT / "target" / "release" / "meshmark"
# What the pages say about files, which maps in memory are not.
OF_FILES = ("What was compared", "What makes this evidence", "How to repeat it")


def marked(layers, key, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return meshmark.mark(layers, key, **options)


def sections_of(page):
    """Return the sections of a page by their titles, without the name of the suspect."""
    page = re.sub(r'The map <span class="name">[^<]*</span>', "The map", page)
    parts = re.findall(r"<section.*?</section>", page, re.S)
    titled = {re.search(r"<h[12][^>]*>(.*?)</h[12]>", part, re.S).group(1): part for part in parts}
    return {title: part for title, part in titled.items() if title not in OF_FILES}


class LikeTheCommand(Folder):
    """Compares reports with those of the command on the same files."""

    def by_command(self, suspect, *references, **flags):
        """Return verdict, report and page of the command."""
        key = self.folder / "key.json"
        if not key.exists():
            self.key.write(key)
        reports = {}
        for ending in ("json", "html"):
            file = self.folder / f"report.{ending}"
            file.unlink(missing_ok=True)
            words = [word for reference in references for word in ("--reference", reference)]
            words += [word for name, value in flags.items() for word in (f"--{name}", value)]
            command = [COMMAND, "verify", "--key", key, *words, "--report", file, suspect]
            done = subprocess.run(command, capture_output=True, text=True)
            self.assertIn(done.returncode, (0, 1, 3), done.stderr)
            reports[ending] = file.read_text()
        return done.stdout, json.loads(reports["json"]), reports["html"]

    def check(self, report, suspect, *references, **flags):
        """Check a report against that of the command, and return it."""
        text, expected, page = self.by_command(suspect, *references, **flags)
        self.assertIsNotNone(expected["provenance"])
        self.maxDiff = 4000
        self.assertEqual(json.dumps(report.to_dict()), json.dumps({**expected, "provenance": None}))
        own, theirs = sections_of(report.to_html()), sections_of(page)
        self.assertEqual(list(own), list(theirs))
        for title, section in own.items():
            self.assertEqual(section, theirs[title], title)
        self.assertEqual(str(report), text)
        return report

    def written(self, layers, name="suspect.gpkg"):
        """Write layers to a file, and return its path and its layers as they are read."""
        path = self.folder / name
        for layer, frame in layers.items():
            frame.to_file(path, layer=layer, driver="GPKG")
        return path, layers_of(path)

    def recorded(self, record, name="record.json"):
        path = self.folder / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(record.to_json())
        return path

    def check_of(self, source, attack, verdict, **options):
        """Mark a map, attack the copy, and compare the reports about it."""
        layers = layers_of(source)
        copies, record = marked(layers, self.key, **options)
        path, suspect = self.written({name: attack(frame) for name, frame in copies.items()})
        report = meshmark.verify(suspect, layers, self.key, record)
        self.check(report, path, source, record=self.recorded(record))
        self.assertEqual(report.verdict, verdict)
        return report

    def test_a_whole_copy(self):
        report = self.check_of(FIXTURES / "helsinki.gpkg", lambda frame: frame, "match", recipient="ACME GmbH")
        self.assertEqual((report.recipient, report.key_id), ("ACME GmbH", self.key.id))
        self.assertLess(report.p_value_log10, -100)
        self.assertGreater(report.matched_vertices, 0.9 * report.reference_vertices)

    def test_a_message(self):
        message = "00112233445566778899aabbccddeeff"
        report = self.check_of(FIXTURES / "kotka.gpkg", lambda frame: frame, "match", message=message)
        self.assertEqual(report.message, message)

    def test_a_crop_that_was_moved_and_turned(self):
        def attack(frame):
            left, _, right, _ = frame.total_bounds
            crop = frame[frame.geometry.representative_point().x < (left + right) / 2].reset_index(drop=True)
            turned = crop.geometry.rotate(12, origin=(left, 0)).translate(40, -70)
            return crop.set_geometry(turned)

        source = FIXTURES / "kotka.gpkg"
        report = self.check_of(source, attack, "match", recipient="ACME GmbH")
        self.assertLess(report.matched_vertices, 0.7 * report.reference_vertices)

    def test_degrees(self):
        layers = {name: frame.to_crs("EPSG:4326") for name, frame in layers_of(FIXTURES / "kotka.gpkg").items()}
        source, _ = self.written(layers, "degrees.gpkg")
        self.check_of(source, lambda frame: frame, "match", recipient="ACME GmbH")

    def test_a_suspect_without_a_crs(self):
        def attack(frame):
            return frame.set_crs(None, allow_override=True)

        self.check_of(FIXTURES / "kotka.gpkg", attack, "match", recipient="ACME GmbH")

    def test_an_unmarked_map_and_another_key(self):
        source = FIXTURES / "kotka.gpkg"
        layers = layers_of(source)
        copies, record = marked(layers, self.key, recipient="ACME GmbH")
        unmarked = meshmark.verify(layers, layers, self.key, record)
        self.check(unmarked, source, source, record=self.recorded(record))
        self.assertEqual(unmarked.verdict, "no-match")
        path, suspect = self.written(copies)
        self.key = meshmark.Key.generate()
        report = meshmark.verify(suspect, layers, self.key, recipient="ACME GmbH")
        (self.folder / "key.json").unlink()
        self.check(report, path, source, recipient="ACME GmbH")
        self.assertEqual((report.is_match, report.shows_key), (False, False))

    def test_who_leaked(self):
        source = FIXTURES / "kotka.gpkg"
        layers = layers_of(source)
        records = {}
        for recipient in ("A", "B", "C"):
            copies, record = marked(layers, self.key, recipient=recipient)
            records[f"{recipient}.json"] = record
            self.recorded(record, f"records/{recipient}.json")
            if recipient == "B":
                path, suspect = self.written(copies)
        report = meshmark.verify(suspect, layers, self.key, records=records)
        self.check(report, path, source, records=self.folder / "records")
        self.assertEqual((report.verdict, report.recipient), ("match", "B"))
        unnamed = meshmark.verify(suspect, layers, self.key, records=list(records.values()))
        self.assertEqual(unnamed.to_dict()["candidates"]["list"][0]["record"], "record 2")
        innocent = meshmark.verify(layers, layers, self.key, records=records)
        self.check(innocent, source, source, records=self.folder / "records")
        self.assertEqual((innocent.verdict, innocent.recipient), ("no-match", None))
        named = meshmark.verify(layers, layers, self.key, records=records, show_recipients=True)
        self.assertEqual((named.recipient, named.recipients), (None, []))
        self.assertIn(named.to_dict()["candidates"]["list"][0]["recipient"], ("A", "B", "C"))

    def test_an_edition_that_rests_on_an_earlier_one(self):
        first = FIXTURES / "kotka.gpkg"
        layers = layers_of(first)
        _, record = marked(layers, self.key, recipient="ACME GmbH")
        base = self.recorded(record, "base.json")
        second, newer = self.written({name: frame.iloc[len(frame) // 10 :] for name, frame in layers.items()}, "second.gpkg")
        self.key.write(self.folder / "key.json")
        copy, made = self.folder / "copy.gpkg", self.folder / "second.json"
        options = {"KEY": self.folder / "key.json", "RECIPIENT": "ACME GmbH", "RECORD": made, "BASE": base, "BASE_REFERENCE": first}
        words = [word for name, value in options.items() for word in ("-oo", f"{name}={value}")]
        command = ["ogr2ogr", "-f", "GPKG", copy, f"MESHMARK:{second}", *words]
        subprocess.run(command, check=True, capture_output=True, env={**os.environ, "GDAL_DRIVER_PATH": str(PLUGINS)})
        record = meshmark.Record.read(made)
        report = meshmark.verify(layers_of(copy), [newer, layers], self.key, record)
        self.check(report, copy, second, first, record=made)
        self.assertTrue(report.is_match)
        with self.assertRaisesRegex(meshmark.RecordError, "no map given is the reference of a base"):
            meshmark.verify(layers_of(copy), newer, self.key, record)

    def test_what_is_given_besides(self):
        source = FIXTURES / "kotka.gpkg"
        layers = layers_of(source)
        copies, record = marked(layers, self.key, recipient="ACME GmbH")
        path, suspect = self.written(copies)
        given = {"radius": 0.5, "significance": 1e-9, "registration": "geometry"}
        report = meshmark.verify(suspect, layers, self.key, record, **given)
        flags = {name: str(value) for name, value in given.items()}
        self.check(report, path, source, record=self.recorded(record), **flags)
        self.assertEqual(report.radius_m, 0.5)


class Reports(Folder):
    def setUp(self):
        super().setUp()
        self.town = town()
        self.copy, self.record = meshmark.mark(self.town, self.key, recipient="<ACME> & Co")

    def test_another_crs_is_found(self):
        elsewhere = self.copy.to_crs("EPSG:3857")
        self.assertTrue(meshmark.verify(elsewhere, self.town, self.key, self.record).is_match)
        lost = elsewhere.set_crs(None, allow_override=True)
        report = meshmark.verify(lost, self.town, self.key, self.record)
        self.assertTrue(report.is_match)
        self.assertIn("EPSG:3857", report.registration)

    def test_every_kind_of_layer(self):
        array, table = self.copy.geometry.to_numpy(), pyarrow.table(self.copy.to_arrow())
        for suspect in (self.copy, self.copy.geometry, array, table, {"any": self.copy}):
            for reference in (self.town, [self.town], self.town.geometry, pyarrow.table(self.town.to_arrow())):
                self.assertTrue(meshmark.verify(suspect, reference, self.key, self.record).is_match)

    def test_several_editions(self):
        other = town(side=18)
        report = meshmark.verify(self.copy, [other, self.town], self.key, self.record)
        self.assertTrue(report.is_match)
        with self.assertRaisesRegex(meshmark.OptionError, "several references.*record or records"):
            meshmark.verify(self.copy, [other, self.town], self.key)
        with self.assertRaisesRegex(meshmark.RecordError, "none of the 2 references given"):
            meshmark.verify(self.copy, [other, other], self.key, self.record)

    def test_damaged_features_are_left_out_and_what_is_given_stays(self):
        frame = self.copy.copy()
        frame.loc[3, "geometry"] = None
        frame.loc[4, "geometry"] = shapely.Point()
        frame.loc[5, "geometry"] = shapely.LineString([(0, 0), (numpy.nan, 7), (3, 3)])
        before, bytes_before = frame.copy(), shapely.to_wkb(frame.geometry.array)
        report = meshmark.verify(frame, self.town, self.key, self.record)
        self.assertTrue(report.is_match)
        self.assertEqual(report.to_dict()["left_out"]["coordinates"], 1)
        self.assertTrue((shapely.to_wkb(frame.geometry.array) == bytes_before).all())
        self.assertTrue(frame.drop(columns="geometry").equals(before.drop(columns="geometry")))
        empty = meshmark.verify(frame.iloc[:0], self.town, self.key, self.record)
        self.assertEqual(empty.verdict, "inconclusive")

    def test_the_page_of_a_notebook_holds_no_markup_of_names(self):
        report = meshmark.verify(self.copy, self.town, self.key, self.record)
        cell = report._repr_html_()
        self.assertTrue(cell.startswith("<iframe srcdoc=") and cell.count("<") == 2)
        self.assertNotIn("<ACME>", report.to_html())
        self.assertRegex(repr(report), "<meshmark.Report match, recipient .*, p-value 10\\^-")
        self.assertEqual(report.to_dict(), json.loads(report.to_json()))

    def test_threads_change_nothing(self):
        reports = [meshmark.verify(self.copy, self.town, self.key, self.record, threads=threads) for threads in (1, 3)]
        self.assertEqual(reports[0].to_json(), reports[1].to_json())

    def test_progress_names_the_stages(self):
        seen = []
        meshmark.verify(self.copy, self.town, self.key, self.record, progress=lambda *event: seen.append(event))
        self.assertTrue(all(isinstance(stage, str) and done >= 0 <= all_ for stage, done, all_ in seen))

        def stop(*_):
            raise RuntimeError("enough")

        with self.assertRaisesRegex(RuntimeError, "enough"):
            meshmark.verify(self.copy, self.town, self.key, self.record, progress=stop)

    def test_an_interrupt_ends_a_verification(self):
        script = (
            "import meshmark, sys; sys.path.insert(0, sys.argv[1]); from test_marking import town\n"
            "map, key = town(60), meshmark.Key.generate(); copy, record = meshmark.mark(map, key, recipient='A')\n"
            "print('ready', flush=True)\n"
            "while True: meshmark.verify(copy, map, key, record)\n"
        )
        command = [os.sys.executable, "-c", script, str(pathlib.Path(__file__).parent)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            self.assertEqual(process.stdout.readline().strip(), "ready")
            time.sleep(0.5)
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=120)
        self.assertIn("KeyboardInterrupt", errors)


class Refused(Folder):
    def setUp(self):
        super().setUp()
        self.town = town()
        self.copy, self.record = meshmark.mark(self.town, self.key, recipient="ACME GmbH")

    def check(self, error, text, *arguments, **named):
        with self.assertRaisesRegex(error, text):
            meshmark.verify(*arguments, **named)

    def test_what_does_not_belong_together(self):
        other = meshmark.Key.generate()
        self.check(meshmark.RecordError, "another key than this one", self.copy, self.town, other, self.record)
        changed = self.town.iloc[:-1]
        text = "another reference .* than this one .*give the file that was marked, unchanged"
        self.check(meshmark.RecordError, text, self.copy, changed, self.key, self.record)
        with self.assertWarnsRegex(UserWarning, "another key than this one"):
            self.check(meshmark.RecordError, "none of the records", self.copy, self.town, other, records=[self.record])

    def test_options(self):
        maps = (self.copy, self.town, self.key)
        self.check(meshmark.OptionError, "amplitude=9 contradicts the record", *maps, self.record, amplitude=9)
        self.check(meshmark.OptionError, "significance=0.5 is not legal", *maps, self.record, significance=0.5)
        self.check(meshmark.OptionError, "registration=north is not legal", *maps, registration="north")
        self.check(meshmark.OptionError, "radius=-1 is not legal", *maps, self.record, radius=-1)
        self.check(meshmark.OptionError, 'no field "street": landmarks may name number', *maps, self.record, landmarks=["street"])
        self.check(meshmark.OptionError, "srs=EPSG:nowhere is not a CRS", *maps, srs="EPSG:nowhere")
        self.check(meshmark.OptionError, "demodulator of the paper", *maps, self.record, demodulator="paper")
        self.check(TypeError, "verify\\(\\) has no option colour", *maps, colour="red")
        self.check(TypeError, "records or record, and not both", *maps, self.record, records=[self.record])
        self.check(TypeError, "needs a reference", self.copy, [], self.key)
        self.check(ValueError, "threads=0", *maps, self.record, threads=0)

    def test_arguments_of_another_type(self):
        maps = (self.copy, self.town, self.key)
        read = "and not a Record: read one with meshmark.Record.read"
        self.check(TypeError, f"record is 'acme.json', a str, {read}", *maps, "acme.json")
        self.check(TypeError, "record is {.*}, a dict, and not a Record", *maps, json.loads(self.record.to_json()))
        self.check(TypeError, "records is 'records', a str, and not a list or dict of Record", *maps, records="records")
        self.check(TypeError, "records is 3, a int, and not a list or dict", *maps, records=3)
        self.check(TypeError, "records is <.*Record.*>, a Record, and not a list", *maps, records=self.record)
        self.check(TypeError, f"records has 'acme.json', a str, {read}", *maps, records=["acme.json"])
        self.check(TypeError, f"records has None, a NoneType, {read}", *maps, records={"acme.json": None})
        self.check(TypeError, "a name in records is 1, a int, and not a text", *maps, records={1: self.record})
        self.check(TypeError, "key is a str, and not a Key: .*Key.read", self.copy, self.town, "key.json", self.record)
        self.check(TypeError, "landmarks is the text 'number', .* use \\['number'\\]", *maps, landmarks="number")
        self.check(TypeError, "radius is '1', a str, and not a number", *maps, radius="1")
        self.check(TypeError, "significance is None, a NoneType, and not a number", *maps, significance=None)
        self.check(TypeError, "show_recipients is 'no', a str, and not True or False", *maps, show_recipients="no")
        self.check(TypeError, "threads is '2', a str, and not a whole number", *maps, threads="2")
        self.check(TypeError, "progress is 3, a int, and not a function", *maps, progress=3)
        report = meshmark.verify(*maps, records=(record for record in [self.record]), exact_displacements=numpy.bool_(False))
        self.assertTrue(report.is_match)

    def test_the_recipients_are_those_whose_records_match(self):
        reference = town(40)
        made = list(meshmark.distribute(reference, self.key, ["A", "B", "C"]))
        copies, records = [copy for _, copy, _ in made], {name: record for name, _, record in made}
        half = len(reference) // 2
        mixture = copies[0].copy()
        mixture.loc[half:, "geometry"] = copies[1].geometry.iloc[half:]
        report = meshmark.verify(mixture, reference, self.key, records=records)
        self.assertEqual((report.verdict, sorted(report.recipients), report.recipient), ("match", ["A", "B"], None))
        self.assertRegex(repr(report), "recipients ")
        report = meshmark.verify(copies[0], reference, self.key, records=records)
        self.assertEqual((report.recipients, report.recipient), (["A"], "A"))
        for show in (False, True):
            report = meshmark.verify(copies[0], reference, self.key, records=[records["C"]], show_recipients=show)
            self.assertEqual((report.is_match, report.recipients, report.recipient), (False, [], None))
        report = meshmark.verify(copies[0], reference, self.key, records["C"])
        self.assertEqual((report.is_match, report.recipients, report.recipient), (False, ["C"], "C"))

    def test_a_reference_has_the_crs_of_its_record(self):
        web = self.town.to_crs("EPSG:3857")
        copy, record = meshmark.mark(web, self.key, recipient="ACME GmbH")
        expected = meshmark.verify(copy, web, self.key, record)
        bare = web.set_crs(None, allow_override=True)
        for srs in (None, "EPSG:3857"):
            report = meshmark.verify(copy, bare, self.key, record, srs=srs)
            self.assertEqual(report.p_value_log10, expected.p_value_log10)
            self.assertEqual(report.to_dict()["parameters"]["crs_source"], "record")
        self.check(meshmark.OptionError, "srs=EPSG:3067 contradicts the record", copy, bare, self.key, record, srs="EPSG:3067")
        wrong = web.set_crs("EPSG:4326", allow_override=True)
        with self.assertWarnsRegex(UserWarning, "the reference states EPSG:4326, and its record EPSG:3857"):
            report = meshmark.verify(copy, wrong, self.key, record)
        self.assertEqual(report.p_value_log10, expected.p_value_log10)
        self.assertEqual(report.to_dict()["parameters"]["crs_of_reference"], "EPSG:4326")

    def test_a_geometry_column_that_one_map_has(self):
        wkb = pyarrow.array(self.copy.geometry.to_wkb(), pyarrow.binary())
        table = pyarrow.table({"number": self.copy.number.tolist(), "shape": wkb})
        report = meshmark.verify(table, self.town, self.key, self.record, geometry="shape")
        self.assertTrue(report.is_match)
        self.assertGreater(meshmark.compare(self.town, table, geometry="shape").rms_m, 0.01)
        described = pyarrow.table(self.town.to_arrow(geometry_encoding="WKB", index=False))
        self.assertTrue(meshmark.verify(table, described, self.key, self.record, geometry="shape").is_match)
        self.check(TypeError, "geometry='form' is for tables .* no map has such a column", self.copy, self.town, self.key, geometry="form")
        self.check(TypeError, "not one column 'form': it has number, shape", table, self.town, self.key, geometry="form")

    def test_maps(self):
        broken = self.town.copy()
        broken.loc[7, "geometry"] = shapely.LineString([(0, 0), (numpy.inf, 1)])
        self.check(meshmark.MapError, 'the reference: layer "layer", feature 7: .*not finite', self.copy, broken, self.key)
        degrees = town(crs=None).set_geometry(self.town.geometry.set_crs(None, allow_override=True).scale(1e-3, 1e-3, origin=(0, 0)))
        self.check(meshmark.MapError, "the reference: the map has no CRS", degrees, degrees, self.key, recipient="A")
        self.check(TypeError, "layer 'layer' is a list", self.copy, [[1, 2]], self.key)

    def test_layers_that_a_record_names(self):
        layers = {"houses": self.town, "roads": self.town.geometry.boundary.to_frame("geometry").iloc[:20]}
        text = json.loads(self.record.to_json())
        path = self.folder / "record.json"
        path.write_text(json.dumps({**text, "layers": ["houses"]}))
        record = meshmark.Record.read(path)
        self.assertTrue(meshmark.verify(self.copy, layers, self.key, record).is_match)
        lacking = {"roads": layers["roads"]}
        self.check(meshmark.MapError, 'no layer "houses": layers may name roads', self.copy, lacking, self.key, record)


if __name__ == "__main__":
    unittest.main()
