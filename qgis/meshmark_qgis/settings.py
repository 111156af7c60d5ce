"""The settings for all runs: every setting is a path, empty when it is not set."""

from qgis.core import QgsSettings

COMMAND = "command"
DRIVER_FOLDER = "driver_folder"
KEY_FILE = "key_file"
RECORD_FOLDER = "record_folder"


def get(name):
    return QgsSettings().value(f"meshmark/{name}", "", type=str).strip()


def put(name, path):
    QgsSettings().setValue(f"meshmark/{name}", path.strip())
