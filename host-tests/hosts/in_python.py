"""Writes through MESHMARK with GDAL's Python; python.sh verifies the copies.

A failure must leave no file.
"""

import multiprocessing
import os

import folder
from osgeo import gdal, ogr, osr

gdal.UseExceptions()
ogr.UseExceptions()
osr.UseExceptions()


def creation_options(name, key="key.json"):
    return [f"KEY={key}", "RECIPIENT=ACME GmbH", f"REFERENCE={name}.reference.gpkg", f"RECORD={name}.json"]


def write_all_layers():
    written = gdal.VectorTranslate(
        "MESHMARK:written.gpkg",
        "map.gpkg",
        format="MESHMARK",
        dstSRS="EPSG:3857",
        reproject=True,
        datasetCreationOptions=creation_options("written"),
    )
    assert not os.path.exists("written.gpkg"), "the target is there before it is closed"
    del written


def read_with_wrong_key():
    try:
        gdal.OpenEx("MESHMARK:map.gpkg", open_options=["KEY=wrong.json", "RECIPIENT=B"])
    except RuntimeError as error:
        assert "wrong.json is not usable" in str(error), error
    else:
        raise AssertionError("a wrong key file is accepted")


def write_with_wrong_key():
    options = creation_options("wrong", key="wrong.json")
    try:
        gdal.VectorTranslate("MESHMARK:wrong.gpkg", "map.gpkg", format="MESHMARK", datasetCreationOptions=options)
    except RuntimeError as error:
        assert "wrong.json is not usable" in str(error) or "failed to create" in str(error), error
    else:
        raise AssertionError("a wrong key file is accepted")


def create(name):
    options = creation_options(name)
    return gdal.GetDriverByName("MESHMARK").Create(f"MESHMARK:{name}.gpkg", 0, 0, 0, gdal.GDT_Unknown, options=options)


def close_a_map_that_cannot_be_marked():
    dataset = create("small")
    crs = osr.SpatialReference()
    crs.ImportFromEPSG(3067)
    layer = dataset.CreateLayer("buildings", crs, ogr.wkbPolygon)
    feature = ogr.Feature(layer.GetLayerDefn())
    feature.SetGeometry(ogr.CreateGeometryFromWkt("POLYGON ((0 0,1 0,1 1,0 1,0 0))"))
    layer.CreateFeature(feature)
    del layer, dataset  # raises no exception (docs/driver.md): Python prints that one is ignored
    assert "the whole map is" in gdal.GetLastErrorMsg(), gdal.GetLastErrorMsg()


def fail_between_two_features():
    source = gdal.OpenEx("map.gpkg")
    dataset = create("half")
    try:
        dataset.StartTransaction()
        dataset.CopyLayer(source.GetLayer("roads"), "roads")
        raise KeyError("a mistake of the program")
    except KeyError:
        del dataset
    assert "transaction" in gdal.GetLastErrorMsg(), gdal.GetLastErrorMsg()


def copy_for(recipient, more=(), **selection):
    """Writes copy.gpkg as docs/driver.md shows it, and returns whether its check passes."""
    options = ["KEY=key.json", f"RECIPIENT={recipient}", f"REFERENCE={recipient}.gpkg", f"RECORD={recipient}.json", *more]
    try:
        written = gdal.VectorTranslate(
            "MESHMARK:copy.gpkg", "map.gpkg", format="MESHMARK", datasetCreationOptions=options, **selection
        )
    except RuntimeError:
        return False
    gdal.ErrorReset()
    del written
    return gdal.GetLastErrorType() != gdal.CE_Failure and os.path.exists("copy.gpkg")


def an_older_copy_is_no_success():
    too_small = {"layers": ["buildings"], "where": "fid < 3"}
    replace = ["OVERWRITE=YES"]
    with folder.unchanged("python: the older copy of A stays in the place of B's"):
        assert not copy_for("B"), "an older file passes for the copy"
        assert not copy_for("B", **too_small), "an older file passes for the copy"
        assert not copy_for("B", replace, **too_small), "an older file passes for the copy that should replace it"
    assert copy_for("B", replace), "a copy that replaces the older one fails the check"


def marked_by_reading(recipient):
    """Returns the geometries of the map, marked for a recipient."""
    dataset = gdal.OpenEx("MESHMARK:map.gpkg", open_options=["KEY=key.json", f"RECIPIENT={recipient}"])
    layers = (dataset.GetLayer(number) for number in range(dataset.GetLayerCount()))
    return [feature.GetGeometryRef().ExportToWkb() for layer in layers for feature in layer]


def children_mark_like_their_parent():
    """A child of a fork has none of its parent's threads, and must not wait for them."""
    of_parent = [marked_by_reading(recipient) for recipient in "AB"]
    with multiprocessing.get_context("fork").Pool(2) as children:
        of_children = children.map_async(marked_by_reading, "AB").get(timeout=600)
    assert of_children == of_parent, "a child marks differently"
    children = multiprocessing.get_context("fork").Pool(1)
    assert children.apply_async(copy_for, ["child"]).get(timeout=600), "a copy of a child fails the check"
    os.remove("copy.gpkg")
    print("passed: python: children of a fork mark like their parent", flush=True)


write_all_layers()
children_mark_like_their_parent()
assert copy_for("A"), "a copy in a free place fails the check"
an_older_copy_is_no_success()
with folder.unchanged("python: a wrong key file, reading"):
    read_with_wrong_key()
with folder.unchanged("python: a wrong key file, writing"):
    write_with_wrong_key()
with folder.unchanged("python: closing fails"):
    close_a_map_that_cannot_be_marked()
with folder.unchanged("python: the program fails between two features, in a transaction"):
    fail_between_two_features()
