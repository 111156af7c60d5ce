"""Texts for people, which a translation may replace."""

from qgis.PyQt.QtCore import QCoreApplication


def tr(text):
    return QCoreApplication.translate("meshmark", text)
