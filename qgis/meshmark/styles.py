"""How the layers of the evidence look: colours that colour-blind people tell apart (Okabe and Ito 2008)."""

from qgis.core import (
    QgsArrowSymbolLayer,
    QgsFillSymbol,
    QgsLineSymbol,
    QgsMarkerSymbol,
    QgsProcessingLayerPostProcessorInterface,
    QgsRuleBasedRenderer,
    QgsSimpleMarkerSymbolLayer,
    QgsUnitTypes,
    QgsVectorFieldSymbolLayer,
    QgsVectorLayerUtils,
)
from qgis.PyQt.QtGui import QColor

from .text import tr

MILLIMETRES = QgsUnitTypes.RenderMillimeters
# An arrow of average length on the screen.
ARROW_MM = 3.0


def vertices(layer):
    """Arrows of the displacements; the weight is how well one fits in with those around it."""
    values, _ = QgsVectorLayerUtils.getValues(layer, "moved_m")
    rms_m = (sum(v * v for v in values) / len(values)) ** 0.5 if values else 0.0
    scale = ARROW_MM / rms_m if rms_m > 0 else 1.0
    return rules(
        [
            (tr("fits in with its neighbours"), '"weight" >= 0.9', arrow("#0072b2", scale)),
            (tr("fits in with them less well"), '"weight" >= 0.5 AND "weight" < 0.9', arrow("#e69f00", scale)),
            (tr("does not fit in: edited, or matched wrongly"), '"weight" < 0.5', arrow("#d55e00", scale)),
        ]
    )


def patches(_layer):
    """The score is standard normal under a wrong key: beyond 4 once in 30 000 patches."""
    return rules(
        [
            (tr("the mark shows clearly (score of 6 and more)"), '"score" >= 6', area("#0072b2", 110)),
            (tr("the mark shows (score of 3 to 6)"), '"score" >= 3 AND "score" < 6', area("#56b4e9", 90)),
            (tr("says nothing by itself (score below 3)"), '"score" < 3', area("#f0e442", 60)),
            (tr("not tested"), '"score" IS NULL', area("#999999", 30)),
        ]
    )


def rules(entries):
    root = QgsRuleBasedRenderer.Rule(None)
    for label, expression, symbol in entries:
        root.appendChild(QgsRuleBasedRenderer.Rule(symbol, 0, 0, expression, label))
    return QgsRuleBasedRenderer(root)


def arrow(colour, scale):
    shaft = QgsArrowSymbolLayer.create({"is_curved": "0", "arrow_width": "0.25", "arrow_start_width": "0.25"})
    shaft.setHeadLength(0.9)
    shaft.setHeadThickness(0.5)
    fill = QgsFillSymbol.createSimple({"color": colour, "outline_style": "no"})
    shaft.setSubSymbol(fill)
    line = QgsLineSymbol()
    line.changeSymbolLayer(0, shaft)
    shift = QgsVectorFieldSymbolLayer()
    shift.setXAttribute("dx_m")
    shift.setYAttribute("dy_m")
    shift.setScale(scale)
    shift.setDistanceUnit(MILLIMETRES)
    shift.setSubSymbol(line)
    dot = QgsSimpleMarkerSymbolLayer(size=0.7)
    dot.setColor(QColor(colour))
    dot.setStrokeColor(QColor(colour))
    symbol = QgsMarkerSymbol()
    symbol.changeSymbolLayer(0, dot)
    symbol.appendSymbolLayer(shift)
    return symbol


def area(colour, opacity):
    red, green, blue, _ = QColor(colour).getRgb()
    style = {"color": f"{red},{green},{blue},{opacity}", "outline_color": "90,90,90,180", "outline_width": "0.3"}
    return QgsFillSymbol.createSimple(style)


class Styler(QgsProcessingLayerPostProcessorInterface):
    """Gives a layer its look when it is added to the project."""

    def __init__(self, renderer_of):
        super().__init__()
        self._renderer_of = renderer_of

    def postProcessLayer(self, layer, context, feedback):
        layer.setRenderer(self._renderer_of(layer))
        layer.triggerRepaint()


# The framework does not keep post-processors alive.
_STYLERS = {}


def processor(name):
    """The post-processor of the layer of this name."""
    return _STYLERS.setdefault(name, Styler({"vertices": vertices, "patches": patches}[name]))
