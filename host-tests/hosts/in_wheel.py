"""Marks with the GDAL 3.12 of pyogrio's wheel, by reading and by writing, and provokes failures."""

import os
import pathlib

import geopandas
import pyogrio

assert pyogrio.__gdal_version__ >= (3, 12), pyogrio.__gdal_version__
assert pyogrio.list_drivers().get("MESHMARK") == "rw", "the driver is not loaded"

OPTIONS = {"KEY": "key.json", "RECIPIENT": "ACME GmbH"}


def coordinates(frame):
    return frame.geometry.get_coordinates().to_numpy()


def read(record=None, **options):
    options = OPTIONS | ({"RECORD": record} if record else {}) | options
    return geopandas.read_file("MESHMARK:map.gpkg", layer="buildings", engine="pyogrio", **options)


def refused(action, *words):
    try:
        action()
    except Exception as error:  # pyogrio's errors have no common class
        assert all(word in str(error) for word in words), f"{words} are not in: {error}"
        print(f"refused: {words[0]}")
        return
    raise AssertionError(f"not refused: {words}")


plain = geopandas.read_file("map.gpkg", layer="buildings", engine="pyogrio")
marked = read("read.json")
moved = abs(coordinates(marked) - coordinates(plain))
assert 0.0 < moved.max() <= 0.75, moved.max()
assert (marked.drop(columns="geometry") == plain.drop(columns="geometry")).where(plain.notna()).fillna(True).all(None)
marked.to_file("read.gpkg", layer="buildings", engine="pyogrio")

# The mark does not depend on the version of GDAL.
older = geopandas.read_file("marked_by_system.gpkg", layer="buildings", engine="pyogrio")
assert (coordinates(marked) == coordinates(older)).all(), "another GDAL, other coordinates"
assert pathlib.Path("read.json").read_bytes() == pathlib.Path("marked_by_system.json").read_bytes()


def write(target, **options):
    options = OPTIONS | {"REFERENCE": f"{target}.reference.gpkg", "RECORD": f"{target}.json"} | options
    plain.to_file(f"MESHMARK:{target}.gpkg", driver="MESHMARK", engine="pyogrio", layer="buildings", **options)


write("written")
assert os.path.exists("written.gpkg") and os.path.exists("written.reference.gpkg")
before = sorted(os.listdir())
refused(lambda: read(KEY="wrong.json"), "wrong.json")
refused(lambda: read(AMPLITUDE="much"), "AMPLITUDE")
refused(lambda: write("written"), "written.gpkg")
refused(lambda: write("other", KEY="missing.json"), "missing.json")
refused(lambda: write("other", CHIP_RATE="1000"), "vertices")
assert sorted(os.listdir()) == before, set(os.listdir()) ^ set(before)
