"""Marking with the GDAL driver MESHMARK, in a process of `ogr2ogr`."""

import os
import re

from qgis.core import QgsProcessingException

from . import commands, driver
from .algorithm import sentences
from .text import tr


def find():
    """Raises Missing unless driver and ogr2ogr are installed."""
    driver.find()
    commands.ogr2ogr()


def options():
    """Returns the creation options of the driver, in its order."""
    return driver.options()


def export(source, output, values, feedback):
    """Marks a GeoPackage in a child process, which can be stopped; the values of options are texts."""
    feedback.setProgressText(tr("Marking"))
    options = [f"{name}={value}" for name, value in values.items()]
    arguments = [commands.ogr2ogr(), "-progress", "-f", "MESHMARK", f"MESHMARK:{output}", source]
    for option in options:
        arguments += ["-dsco", option]
    try:
        finished = commands.run(arguments, feedback, lambda text: feedback.setProgress(percent(text)))
    except commands.Cancelled:
        driver.clear_away(output, options)
        raise
    errors, warnings = sentences(finished.errors)
    for warning in warnings:
        feedback.pushWarning(warning)
    if finished.code != 0:
        ended = tr("ogr2ogr ended with exit code {}.").format(finished.code)
        if "Unable to find driver" in finished.errors:
            errors.append(tr("Is the folder in Settings > Options > meshmark that of a driver for this GDAL?"))
        errors = errors or [ended]
        if os.path.lexists(output):
            errors.append(tr("{} is the older file, not a copy of this run.").format(output))
        raise QgsProcessingException("\n".join(errors))


# The share of an export in which ogr2ogr hands the features to the driver.
HANDING_OVER = 0.1


def percent(text):
    """Returns the progress that ogr2ogr prints: "0...10...20", first that of features, then of the marking."""
    of_features, is_over, of_marking = text.partition("done")
    numbers = re.findall(r"\d+", of_marking if is_over else of_features)
    done = float(numbers[-1]) if numbers else 0.0
    return 100 * HANDING_OVER + (1 - HANDING_OVER) * done if is_over else HANDING_OVER * done
