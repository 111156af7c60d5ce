"""The driver's options as parameters of an algorithm, with the types, bounds, defaults and help of
its list."""

from qgis.core import (
    QgsProcessingParameterBoolean,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterNumber,
    QgsProcessingParameterString,
)

from .text import tr

NUMBER = QgsProcessingParameterNumber.Type
SWITCH = ["NO", "YES"]
# Decimals of numbers that may be in degrees; those with a default are metres.
DECIMALS = 9


def labels():
    """Returns the labels of options; an option of a later driver keeps its own name."""
    return {
        "RECIPIENT": tr("Recipient"),
        "MESSAGE": tr("Message, hexadecimal"),
        "AMPLITUDE": tr("Amplitude, metres"),
        "TOLERANCE": tr("Tolerance, metres"),
        "PRECISION": tr("Precision, CRS units"),
        "SHAPE": tr("Shape"),
        "BASIS": tr("Basis"),
        "CODE": tr("Code"),
        "CHIP_RATE": tr("Chip rate"),
        "PATCH_SIZE": tr("Patch size, vertices"),
        "PART_SIZE": tr("Part size, vertices"),
        "ATTRIBUTES": tr("Unmarked coordinates in attributes"),
        "SRS": tr("CRS where none is set"),
        "OVERWRITE": tr("Replace the file"),
    }


def parameter(option):
    """Returns the parameter for an option of the driver."""
    label = labels().get(option.name, option.name)
    optional = option.default is None
    if option.choices == SWITCH:
        made = QgsProcessingParameterBoolean(option.name, label, option.default == "YES")
    elif option.choices:
        made = QgsProcessingParameterEnum(
            option.name, label, option.choices, False, option.default, optional, usesStaticStrings=True
        )
    elif option.type in ("float", "int"):
        convert, kind = (float, NUMBER.Double) if option.type == "float" else (int, NUMBER.Integer)
        default = None if optional else convert(option.default)
        bounds = [convert(bound) for bound in (option.least, option.most) if bound is not None]
        made = QgsProcessingParameterNumber(option.name, label, kind, default, optional, *bounds)
        made.setMetadata({"widget_wrapper": {"decimals": 3 if option.default else DECIMALS}})
    else:
        made = QgsProcessingParameterString(option.name, label, option.default, False, optional)
    made.setHelp(option.help)
    return made


def advanced(made):
    made.setFlags(made.flags() | QgsProcessingParameterDefinition.Flag.FlagAdvanced)
    return made


def value(algorithm, option, parameters, context):
    """Returns the text of an option, None where it is not given."""
    definition = algorithm.parameterDefinition(option.name)
    given = parameters.get(option.name)
    if given in (None, "") and definition.defaultValue() is None:
        return None
    if option.choices == SWITCH:
        return SWITCH[algorithm.parameterAsBool(parameters, option.name, context)]
    if option.choices:
        return algorithm.parameterAsEnumString(parameters, option.name, context)
    if option.type == "int":
        return str(algorithm.parameterAsInt(parameters, option.name, context))
    if option.type == "float":
        return repr(algorithm.parameterAsDouble(parameters, option.name, context))
    return algorithm.parameterAsString(parameters, option.name, context)
