"""New keys."""

import os

from qgis.core import QgsProcessingException
from qgis.PyQt.QtWidgets import QFileDialog, QMessageBox

from . import engines, settings
from .missing import Missing
from .text import tr


def ask_and_make(parent):
    """Asks for a file and makes a key there; returns its path, None without a key."""
    folder = os.path.dirname(settings.get(settings.KEY_FILE)) or os.path.expanduser("~")
    path, _ = QFileDialog.getSaveFileName(
        parent,
        tr("New key"),
        os.path.join(folder, "key.json"),
        tr("Key files (*.json)"),
        # An existing key is refused below, whatever the answer.
        options=QFileDialog.Option.DontConfirmOverwrite,
    )
    if not path:
        return None
    path = path if os.path.splitext(path)[1] else f"{path}.json"
    try:
        engines.verification().make_key(path)
    except (Missing, QgsProcessingException) as reason:
        QMessageBox.warning(parent, tr("New key"), str(reason))
        return None
    if not settings.get(settings.KEY_FILE):
        settings.put(settings.KEY_FILE, path)
    QMessageBox.information(
        parent,
        tr("New key"),
        tr(
            "The key is in {}. Keep it secret: anyone who has it can read and forge marks. Keep a copy of it safe: without"
            " it no mark can be verified."
        ).format(path),
    )
    return path
