"""The Python package meshmark, the wheel, in the Python of this QGIS."""

import configparser
import contextlib
import importlib
import os
import sys
import warnings

import numpy
from qgis.core import QgsProcessingException

from .commands import Cancelled
from .missing import Missing
from .text import tr


def find():
    """Returns the package; raises Missing, with the command that installs it, unless it fits this plugin."""
    importlib.invalidate_caches()
    try:
        with _own_libraries():
            package = importlib.import_module("meshmark")
    except ImportError as error:
        # A package that it needs may be the missing one.
        raise Missing(
            tr("Or install the Python package meshmark, which needs no driver and no command: {} ({}).").format(
                pip_command(), error
            )
        ) from error
    found, own = getattr(package, "__version__", None), version()
    if found != own or not hasattr(package, "creation_option_list"):
        place = os.path.dirname(getattr(package, "__file__", None) or "")
        raise Missing(
            tr("The Python package meshmark in {} is not that of version {}, which this plugin needs: {}.").format(
                place, own, pip_command()
            )
        )
    return package


@contextlib.contextmanager
def _own_libraries():
    """Lets modules that are imported call the GEOS and PROJ of their wheels; on Linux they would call those of
    QGIS, which may be older."""
    if not hasattr(os, "RTLD_DEEPBIND"):
        yield
        return
    flags = sys.getdlopenflags()
    sys.setdlopenflags(flags | os.RTLD_DEEPBIND)
    try:
        yield
    finally:
        sys.setdlopenflags(flags)


def version():
    """Returns the version of this plugin, which is that of the package that fits."""
    metadata = configparser.ConfigParser(interpolation=None)
    metadata.read(os.path.join(os.path.dirname(__file__), "metadata.txt"), encoding="utf-8")
    return metadata["general"]["version"]


def pip_command():
    """Returns the command that installs the wheel for the Python of this QGIS. Modules of QGIS are compiled for
    its numpy, which pip would otherwise replace."""
    return f'"{interpreter()}" -m pip install numpy=={numpy.__version__} meshmark-{version()}-….whl'


def interpreter():
    """Returns the path of the Python of this QGIS: `sys.executable` may be QGIS itself, or whichever Python is the
    first on the path."""
    name = "python.exe" if sys.platform == "win32" else "python3"
    folders = [sys.exec_prefix, os.path.dirname(sys.executable or "")]
    places = [os.path.join(folder, *below, name) for folder in folders for below in (("bin",), ())]
    return next((place for place in places if os.path.isfile(place)), name)


@contextlib.contextmanager
def reported(feedback):
    """Turns the exceptions of the package into those of QGIS, and its warnings into those of the log."""
    package = find()
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            yield package
    except (package.MeshmarkError, RuntimeError) as error:
        # GDAL raises a RuntimeError where somebody has switched its exceptions on.
        raise QgsProcessingException(str(error)) from error
    except OSError as error:
        raise QgsProcessingException(f"{error.filename}: {error.strerror}" if error.filename else str(error)) from error
    finally:
        for warning in caught:
            if issubclass(warning.category, UserWarning):
                feedback.pushWarning(str(warning.message))


def progress(feedback, from_percent=0.0, to_percent=100.0):
    """Returns what the package calls with its progress, between these: a stage if it has several, steps
    done, all steps. It raises Cancelled."""

    def show(*steps):
        *_, done, all_steps = steps
        if feedback.isCanceled():
            raise Cancelled()
        if all_steps:
            feedback.setProgress(from_percent + (to_percent - from_percent) * done / all_steps)

    return show
