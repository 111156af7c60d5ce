"""Marking: the driver's coordinates and records, bit for bit, and what is refused."""

import multiprocessing
import os
import pathlib
import signal
import stat
import subprocess
import tempfile
import unittest
import warnings

import geopandas
import meshmark
import numpy
import pyogrio
import shapely

ROOT = pathlib.Path(__file__).resolve().parents[2]
FIXTURES = ROOT / "fixtures"
PLUGINS = ROOT / "target" / "release" / "gdalplugins"


def layers_of(path):
    names = pyogrio.list_layers(path)[:, 0]
    return {name: geopandas.read_file(path, layer=name) for name in names}


def town(side=20, crs="EPSG:3067"):
    """Return houses of different sizes."""
    at = [(x, y) for x in range(side) for y in range(side)]
    houses = [shapely.box(20 * x, 20 * y, 20 * x + 9 + x * y % 5, 20 * y + 8 + y % 3) for x, y in at]
    return geopandas.GeoDataFrame({"number": range(len(at))}, geometry=houses, crs=crs)


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.key = meshmark.Key.generate()


class LikeTheDriver(Folder):
    def by_driver(self, source, **options):
        """Return the layers and the text of the record that the driver makes."""
        key, record, copy = (self.folder / name for name in ("key.json", "record.json", "copy.gpkg"))
        self.key.write(key)
        given = {"KEY": key, "RECORD": record, **options}
        pairs = [word for name, value in given.items() for word in ("-oo", f"{name}={value}")]
        command = ["ogr2ogr", "-f", "GPKG", copy, f"MESHMARK:{source}", *pairs]
        subprocess.run(command, check=True, env={**os.environ, "GDAL_DRIVER_PATH": str(PLUGINS)})
        return layers_of(copy), record.read_text()

    def check(self, source, **options):
        expected, record = self.by_driver(source, **options)
        layers = layers_of(source)
        given = {name.lower(): value for name, value in options.items()}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            copies, own = meshmark.mark(layers, self.key, **given)
        self.assertEqual(list(copies), list(expected))
        for name, copy in copies.items():
            found, meant = (shapely.to_wkb(frame.geometry.array) for frame in (copy, expected[name]))
            self.assertTrue((found == meant).all(), name)
            attributes = copy.columns.drop("geometry")
            self.assertTrue(copy[attributes].equals(layers[name][attributes]), name)
        self.assertEqual(own.to_json(), record)

    def test_a_town_in_metres(self):
        self.check(FIXTURES / "helsinki.gpkg", RECIPIENT="ACME GmbH")

    def test_a_town_with_options(self):
        self.check(FIXTURES / "kotka.gpkg", RECIPIENT="Ä & Co", AMPLITUDE=0.2, SHAPE="FREE", PRECISION=0.01)

    def test_a_town_in_parts(self):
        self.check(FIXTURES / "helsinki.gpkg", RECIPIENT="ACME GmbH", PART_SIZE=1920)

    def test_parts_that_carry_no_sign(self):
        line = shapely.LineString([(1000 + at, 0) for at in range(3000)])
        layers = {"houses": town(25), "line": geopandas.GeoDataFrame(geometry=[line], crs="EPSG:3067")}
        with self.assertWarnsRegex(UserWarning, "of 5500 vertices .* stay unmarked, .* raise part_size or lower patch_size"):
            meshmark.mark(layers, self.key, recipient="ACME GmbH", part_size=1920)

    def test_a_message(self):
        self.check(FIXTURES / "kotka.gpkg", MESSAGE="00112233445566778899aabbccddeeff")

    def test_degrees(self):
        self.check(FIXTURES / "europe_deg.gpkg", RECIPIENT="ACME GmbH", AMPLITUDE=200, TOLERANCE=2000)

    def test_units_that_differ_over_the_map(self):
        source = self.folder / "mercator.gpkg"
        for name, frame in layers_of(FIXTURES / "europe_deg.gpkg").items():
            inside = geopandas.clip(frame, (-180, -80, 180, 80))
            inside.to_crs(3857).to_file(source, layer=name)
        self.check(source, RECIPIENT="ACME GmbH", AMPLITUDE=200, TOLERANCE=2000)


class Frames(Folder):
    def mark(self, layers, **options):
        return meshmark.mark(layers, self.key, **{"recipient": "ACME GmbH", **options})

    def test_any_number_of_threads_gives_the_same(self):
        copies = [self.mark(town(), threads=threads)[0] for threads in (1, 2, 3)]
        for copy in copies[1:]:
            self.assertTrue(copy.geometry.geom_equals_exact(copies[0].geometry, 0).all())

    def test_what_is_given_stays(self):
        frame = town()
        before = frame.copy()
        frame.geometry.array._data.flags.writeable = False
        view = frame[frame.number >= 0]
        copy, _ = self.mark(view)
        self.assertTrue(frame.equals(before))
        self.assertFalse(copy.geometry.equals(before.geometry))
        self.assertEqual((copy.crs, list(copy.index)), (frame.crs, list(frame.index)))

    def test_missing_and_empty_geometries_stay(self):
        frame = town()
        frame.loc[7, "geometry"] = None
        frame.loc[8, "geometry"] = shapely.Polygon()
        copy, _ = self.mark(frame)
        self.assertIsNone(copy.geometry[7])
        self.assertTrue(copy.geometry[8].is_empty)
        self.assertEqual(len(copy), len(frame))

    def test_series_and_arrays_are_marked_like_frames(self):
        frame = town()
        meant, _ = self.mark(frame)
        series, _ = self.mark(frame.geometry)
        self.mark(frame.geometry.array, srs="EPSG:3067")
        array, _ = self.mark(frame.geometry.to_numpy().reshape(20, 20), srs="EPSG:3067")
        self.assertTrue((series.to_wkb() == meant.geometry.to_wkb()).all())
        self.assertEqual((series.crs, series.name, array.shape), (frame.crs, "geometry", (20, 20)))
        self.assertTrue((shapely.to_wkb(array.ravel()) == meant.geometry.to_wkb()).all())

    def test_layers_without_a_crs_get_the_given_one(self):
        copy, record = self.mark(town(crs=None), srs="EPSG:3067")
        self.assertEqual((copy.crs, '"crs": "EPSG:3067"' in record.to_json()), (None, True))
        meant, _ = self.mark(town())
        self.assertTrue(copy.geometry.array.geom_equals_exact(meant.geometry.array, 0).all())

    def test_heights_stay(self):
        frame = town()
        frame["geometry"] = shapely.force_3d(frame.geometry.array, numpy.arange(400.0))
        copy, _ = self.mark(frame)
        z = shapely.get_coordinates(copy.geometry.array, include_z=True)[:, 2]
        self.assertTrue((z == numpy.repeat(numpy.arange(400.0), 5)).all())

    def test_all_geometry_columns_are_marked(self):
        frame = town()
        frame["entrance"] = frame.boundary.interpolate(3)
        copy, _ = self.mark(frame)
        self.assertEqual(copy.geometry.name, "geometry")
        self.assertFalse(copy["entrance"].geom_equals_exact(frame["entrance"], 0).any())

    def test_a_process_may_fork_after_a_marking(self):
        self.mark(town())
        self.key.write(self.folder / "key.json")
        with multiprocessing.get_context("fork").Pool(1) as pool:
            self.assertTrue(pool.apply_async(fork_marks, (self.folder / "key.json",)).get(60))

    def test_progress_counts_patches_and_may_fail(self):
        seen = []
        self.mark(town(40), progress=lambda done, all: seen.append((done, all)))
        self.assertTrue(all(done <= patches for done, patches in seen), seen)
        with self.assertRaises(ZeroDivisionError):
            self.mark(town(60), progress=lambda done, all: 1 / 0)

    def test_an_interrupt_ends_a_marking(self):
        frame, seen = town(100), []

        def interrupt(done, all):
            seen.append(done)
            signal.raise_signal(signal.SIGINT)

        with self.assertRaises(KeyboardInterrupt):
            self.mark(frame, progress=interrupt)
        self.assertEqual(len(seen), 1)


def fork_marks(path):
    copy, _ = meshmark.mark(town(), meshmark.Key.read(path), recipient="B")
    return len(copy) == 400


class Refused(Folder):
    def refused(self, error, words, layers, **options):
        with self.assertRaisesRegex(error, words):
            meshmark.mark(layers, self.key, **{"recipient": "ACME", **options})

    def test_maps(self):
        frame = town()
        small = geopandas.GeoDataFrame(geometry=town(crs=None).affine_transform([0.1, 0, 0, 0.1, 0, 0]).array)
        self.refused(meshmark.MapError, "has no CRS.*EPSG:4326", small)
        self.refused(
            meshmark.MapError, "\"b\" \\(EPSG:3857\\).*not in the same CRS", {"a": frame, "b": frame.to_crs(3857)}
        )
        self.refused(meshmark.MapError, "vertices", frame[:3])
        self.refused(meshmark.MapError, "vertices", frame[:0])
        self.refused(TypeError, "no column.*GeoDataFrame", frame.drop(columns="geometry"))
        self.refused(TypeError, "GeoDataFrame", [frame])
        self.refused(TypeError, "GeoDataFrame", {"a": 1})
        hidden = frame.assign(second=frame.geometry.to_numpy().astype(object))
        self.refused(TypeError, "'second' of layer 'layer' holds geometries", hidden)
        self.refused(TypeError, "no active geometry", frame.rename(columns={"geometry": "g"}))
        self.refused(meshmark.MapError, "geocentric", town(crs="EPSG:4978"))
        frame.loc[5, "geometry"] = shapely.Point(numpy.inf, 0)
        self.refused(meshmark.MapError, 'feature 5: .*not finite', frame)
        frame.loc[5, "geometry"] = shapely.Point(1e20, 0)
        self.refused(meshmark.MapError, 'feature 5: .*further away', frame)

    def test_options(self):
        frame = town()
        self.refused(meshmark.OptionError, "amplitude=wide is not a number", frame, amplitude="wide")
        self.refused(meshmark.OptionError, "patch_size=3 .*from 16", frame, patch_size=3)
        self.refused(TypeError, "no option colour: a mark is shaped by amplitude", frame, colour="red")
        self.refused(TypeError, "recipient or a message", frame, message="00")
        self.refused(TypeError, "recipient or a message", frame, recipient=None)
        self.refused(TypeError, "recipient is nan, a float", frame, recipient=float("nan"))
        self.refused(TypeError, "geometry='nix' is for tables", frame, geometry="nix")
        self.refused(ValueError, "threads=0", frame, threads=0)
        self.refused(meshmark.OptionError, "begins or ends with a blank: remove it", frame, recipient="ACME ")
        with self.assertWarnsRegex(UserWarning, "the decomposed form of Unicode"):
            meshmark.mark(frame, self.key, recipient="Cafe\u0301")
        self.refused(meshmark.OptionError, "srs=EPSG:nowhere is not", town(crs=None), srs="EPSG:nowhere")
        self.refused(meshmark.MapError, "EPSG:3067.*srs=EPSG:3857 is another", frame, srs="EPSG:3857")


class Keys(Folder):
    def test_a_key_file_is_new_private_and_read_again(self):
        path = self.folder / "key.json"
        self.key.write(path)
        self.assertEqual(stat.S_IMODE(path.stat().st_mode), 0o600)
        self.assertEqual(meshmark.Key.read(path).id, self.key.id)
        before = path.read_bytes()
        with self.assertRaises(FileExistsError):
            meshmark.Key.generate().write(path)
        self.assertEqual(path.read_bytes(), before)
        self.assertEqual([file.name for file in self.folder.iterdir()], ["key.json"])
        self.assertNotIn(path.read_text().split('"')[-2], repr(self.key))

    def test_what_is_no_key_is_named(self):
        path = self.folder / "other.json"
        path.write_text('{"secret": "of another program"}')
        with self.assertRaisesRegex(meshmark.KeyFileError, "other.json") as caught:
            meshmark.Key.read(path)
        self.assertNotIn("another program", str(caught.exception))
        with self.assertRaises(FileNotFoundError):
            meshmark.Key.read(self.folder / "missing.json")

    def test_a_key_that_others_can_read_is_warned_of(self):
        path = self.folder / "key.json"
        self.key.write(path)
        path.chmod(0o644)
        with self.assertWarnsRegex(UserWarning, "0644.*chmod 600"):
            meshmark.Key.read(path)

    def test_a_record_is_read_again(self):
        _, record = meshmark.mark(town(), self.key, recipient="ACME")
        path = self.folder / "acme.json"
        path.write_text(record.to_json())
        self.assertEqual(meshmark.Record.read(path), record)
        path.write_text("{}")
        with self.assertRaisesRegex(meshmark.RecordError, "acme.json"):
            meshmark.Record.read(path)


if __name__ == "__main__":
    unittest.main()
