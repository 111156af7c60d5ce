"""The list of options, from which the dialog is made: the XML of the driver, or of the Python package."""

from collections import namedtuple
from xml.etree import ElementTree

# An option of the list; numbers and choices are texts, as the list has them.
Option = namedtuple("Option", "name type default least most choices help")


def parsed(xml):
    """Returns the options of a list, in its order."""
    return [
        Option(
            entry.get("name"),
            entry.get("type"),
            entry.get("default"),
            entry.get("min"),
            entry.get("max"),
            [value.text for value in entry.findall("Value")],
            entry.get("description"),
        )
        for entry in ElementTree.fromstring(xml).findall("Option")
    ]
