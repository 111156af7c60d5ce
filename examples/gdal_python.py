"""Marks a map with Python's GDAL, both ways: gdal_python.py MAP KEY RECIPIENT."""

import os
import sys

from osgeo import gdal

gdal.UseExceptions()
source, key, recipient = sys.argv[1:]

# Reading: the map looks marked to whoever opens it with the prefix; any driver may write it.
marked = gdal.OpenEx(f"MESHMARK:{source}", open_options=[f"KEY={key}", f"RECIPIENT={recipient}", "RECORD=read.json"])
gdal.VectorTranslate("read.gpkg", marked, format="GPKG")

# Writing marks the map as the last step, here after a reprojection. REFERENCE is the map as it was
# before the mark.
options = [f"KEY={key}", f"RECIPIENT={recipient}", "RECORD=written.json", "REFERENCE=written.reference.gpkg"]
dataset = gdal.VectorTranslate(
    "MESHMARK:written.gpkg", source, format="MESHMARK", dstSRS="EPSG:3857", datasetCreationOptions=options
)
gdal.ErrorReset()
del dataset  # closing it marks, reads back and publishes
# Closing raises no exception: a failure is the last error. An older file would have been refused
# above.
if gdal.GetLastErrorType() == gdal.CE_Failure or not os.path.exists("written.gpkg"):
    sys.exit(gdal.GetLastErrorMsg() or "written.gpkg is not closed")
