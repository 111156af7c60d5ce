"""Marks a GeoDataFrame as it is exported: geopandas_export.py MAP LAYER KEY RECIPIENT.

Run it with GDAL_DRIVER_PATH=target/wheel/gdalplugins, which `make plugin-for-wheel` makes.
"""

import os
import sys

import geopandas

source, layer, key, recipient = sys.argv[1:]
frame = geopandas.read_file(source, layer=layer, engine="pyogrio")
frame.to_file(
    "MESHMARK:exported.gpkg",
    driver="MESHMARK",
    engine="pyogrio",
    layer=layer,
    KEY=key,
    RECIPIENT=recipient,
    REFERENCE="exported.reference.gpkg",
    RECORD="exported.json",
)
if not os.path.exists("exported.gpkg"):
    sys.exit("exported.gpkg was not written")
