"""The GDAL driver MESHMARK: its place, its options, and the cleanup after a killed export."""

import contextlib
import glob
import os

from osgeo import gdal

from . import option_list, settings
from .missing import Misnamed, Missing
from .text import tr


def find():
    """Returns the driver; loads it from the folder in the settings if GDAL lacks it."""
    driver = gdal.GetDriverByName("MESHMARK")
    folder = settings.get(settings.DRIVER_FOLDER)
    reason = ""
    if driver is None and folder:
        gdal.ErrorReset()
        with _search_path(folder), _quiet():
            gdal.AllRegister()
        reason = gdal.GetLastErrorMsg()
        driver = gdal.GetDriverByName("MESHMARK")
    if driver is not None:
        return driver
    version = gdal.VersionInfo("RELEASE_NAME")
    searched = tr("it is not in {} either ({})").format(folder, reason or tr("no ogr_MESHMARK there")) if folder else ""
    raise (Misnamed if folder else Missing)(
        tr(
            "The GDAL driver MESHMARK is not installed for the GDAL {} of this QGIS{}: install meshmark built for"
            " this GDAL (package meshmark, or `make install` in its sources), or name the folder of ogr_MESHMARK.so"
            " in Settings > Options > meshmark."
        ).format(version, f", {searched}" if searched else "")
    )


def options():
    """Returns the creation options of the driver, in its order."""
    return option_list.parsed(find().GetMetadataItem(gdal.DMD_CREATIONOPTIONLIST))


def environment():
    """Returns the environment in which a child process finds the driver."""
    variables = dict(os.environ)
    folder = settings.get(settings.DRIVER_FOLDER)
    # It replaces the folder where GDAL finds an installed driver, so one without a driver must not.
    if folder and glob.glob(os.path.join(glob.escape(folder), "ogr_MESHMARK.*")):
        variables["GDAL_DRIVER_PATH"] = folder
    return variables


def clear_away(target, creation_options):
    """Removes the remains of a killed export to `target`: starts a new one and cancels it."""
    with _quiet():
        dataset = find().Create(f"MESHMARK:{target}", 0, 0, 0, gdal.GDT_Unknown, creation_options)
        del dataset


@contextlib.contextmanager
def _search_path(folder):
    before = gdal.GetConfigOption("GDAL_DRIVER_PATH")
    gdal.SetConfigOption("GDAL_DRIVER_PATH", folder)
    try:
        yield
    finally:
        gdal.SetConfigOption("GDAL_DRIVER_PATH", before)


@contextlib.contextmanager
def _quiet():
    """Keeps GDAL from printing and raising."""
    raises = gdal.GetUseExceptions()
    gdal.DontUseExceptions()
    gdal.PushErrorHandler("CPLQuietErrorHandler")
    try:
        yield
    finally:
        gdal.PopErrorHandler()
        if raises:
            gdal.UseExceptions()
