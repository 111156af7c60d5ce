"""The styles of the evidence layers: colours for colour-blind readers (Okabe and Ito 2008)."""

import itertools

from qgis.core import (
    QgsArrowSymbolLayer,
    QgsExpression,
    QgsFillSymbol,
    QgsGeometryGeneratorSymbolLayer,
    QgsLayerTreeLayer,
    QgsLineSymbol,
    QgsMarkerSymbol,
    QgsProcessingLayerPostProcessorInterface,
    QgsRuleBasedRenderer,
    QgsVectorLayerUtils,
)
from qgis.PyQt.QtGui import QColor

from .text import tr

# Colours of recipients.
COLOURS = ["#56b4e9", "#e69f00", "#009e73", "#f0e442", "#0072b2", "#d55e00", "#cc79a7"]
# Length of an arrow of typical displacement on the screen, metres.
ARROW_M = 0.003


def displacements(layer):
    """Returns a renderer of arrows, legible at any scale; colours show the weight."""
    values, _ = QgsVectorLayerUtils.getValues(layer, "moved_m")
    rms_m = (sum(v * v for v in values) / len(values)) ** 0.5 if values else 0.0
    exaggeration = f"{ARROW_M / rms_m if rms_m > 0 else 1.0!r} * @map_scale"
    return by_weight(lambda colour: arrow(colour, exaggeration))


def matched_vertices(_layer):
    """Returns a renderer of points; colours show the weight."""
    return by_weight(point)


def by_weight(symbol):
    return rules(
        [
            (tr("agrees with its neighbours"), '"weight" >= 0.9', symbol("#0072b2")),
            (tr("agrees less"), '"weight" >= 0.5 AND "weight" < 0.9', symbol("#e69f00")),
            (tr("does not agree"), '"weight" < 0.5', symbol("#d55e00")),
        ]
    )


def point(colour):
    return QgsMarkerSymbol.createSimple({"color": colour, "size": "1.4", "outline_style": "no"})


def patches(layer):
    """Returns a renderer that colours patches by recipient where the copies of several are mixed, and
    otherwise by score, which is standard normal under a wrong key: one patch of 30 000 exceeds 4."""
    values, _ = QgsVectorLayerUtils.getValues(layer, "recipient")
    recipients = sorted({value for value in values if isinstance(value, str)})
    if len(recipients) > 1:
        colours = zip(recipients, itertools.cycle(COLOURS))
        owned = [(name, f'"recipient" = {QgsExpression.quotedValue(name)}', area(c, 110)) for name, c in colours]
        return rules([*owned, (tr("several recipients, or none"), '"recipient" IS NULL', area("#999999", 30))])
    return rules(
        [
            (tr("clear evidence (6 and more)"), '"score" >= 6', area("#0072b2", 110)),
            (tr("evidence (3 to 6)"), '"score" >= 3 AND "score" < 6', area("#56b4e9", 90)),
            (tr("too little evidence (below 3)"), '"score" < 3', area("#f0e442", 60)),
            (tr("not found or not tested"), '"score" IS NULL', area("#999999", 30)),
        ]
    )


def rules(entries):
    root = QgsRuleBasedRenderer.Rule(None)
    for label, expression, symbol in entries:
        root.appendChild(QgsRuleBasedRenderer.Rule(symbol, 0, 0, expression, label))
    return QgsRuleBasedRenderer(root)


def arrow(colour, exaggeration):
    shaft = QgsArrowSymbolLayer.create(
        {
            "is_curved": "0",
            "arrow_width": "0.25",
            "arrow_start_width": "0.25",
            "head_length": "0.9",
            "head_thickness": "0.5",
        }
    )
    shaft.setSubSymbol(QgsFillSymbol.createSimple({"color": colour, "outline_style": "no"}))
    line = QgsLineSymbol()
    line.changeSymbolLayer(0, shaft)
    end = " + ".join(
        ["{0}(start_point($geometry))", "({1}) * ({0}(end_point($geometry)) - {0}(start_point($geometry)))"]
    )
    ends = ", ".join(end.format(axis, exaggeration) for axis in "xy")
    longer = QgsGeometryGeneratorSymbolLayer.create(
        {"geometryModifier": f"make_line(start_point($geometry), make_point({ends}))", "SymbolType": "Line"}
    )
    longer.setSubSymbol(line)
    symbol = QgsLineSymbol()
    symbol.changeSymbolLayer(0, longer)
    return symbol


def area(colour, opacity):
    red, green, blue, _ = QColor(colour).getRgb()
    style = {"color": f"{red},{green},{blue},{opacity}", "outline_color": "90,90,90,180", "outline_width": "0.3"}
    return QgsFillSymbol.createSimple(style)


def file_of(layer):
    return layer.source().partition("|")[0]


def show_vertices_above(layer):
    """Moves vertices above the patches of the same file: QGIS places and loads layers in an order of its own."""
    node = layer.project().layerTreeRoot().findLayer(layer.id()) if layer.project() else None
    if node is None:
        return
    group = node.parent()
    nodes = [other for other in group.children() if isinstance(other, QgsLayerTreeLayer) and other.layer()]
    nodes = [other for other in nodes if file_of(other.layer()) == file_of(layer)]
    first = min(group.children().index(other) for other in nodes)
    for vertices in [other for other in nodes if not other.layer().source().endswith("|layername=patches")]:
        if group.children().index(vertices) > first:
            group.insertChildNode(first, vertices.clone())
            group.removeChildNode(vertices)


class Styler(QgsProcessingLayerPostProcessorInterface):
    """Sets style and place of a layer when it is added to the project."""

    def __init__(self, renderer_of):
        super().__init__()
        self._renderer_of = renderer_of

    def postProcessLayer(self, layer, context, feedback):
        layer.setRenderer(self._renderer_of(layer))
        layer.triggerRepaint()
        show_vertices_above(layer)


# These references keep post-processors alive until their layer is loaded; QGIS deletes them then,
# so every run has its own.
_STYLERS = {}


def processor(name):
    """Returns a post-processor for the layer of this name."""
    renderer_of = {"patches": patches, "matched_vertices": matched_vertices, "vertex_displacements": displacements}[name]
    _STYLERS[name] = Styler(renderer_of)
    return _STYLERS[name]
