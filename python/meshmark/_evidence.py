"""The evidence map of a verification."""

import numpy
import shapely

from . import _meshmark
from ._layers import Layer


def evidence_map(report: _meshmark.Report) -> dict[str, Layer]:
    """Return the evidence of a report as layers, those of ``meshmark verify --evidence-map``.

    Parameters
    ----------
    report : Report
        A report of `verify` with ``evidence_map=True``.

    Returns
    -------
    layers : dict of str to Layer
        In the CRS of the reference: ``matched_vertices``, points with ``patch`` and ``weight``, or with exact
        displacements ``vertex_displacements``, lines with ``patch``, ``dx_m``, ``dy_m``, ``moved_m`` (metres)
        and ``weight``; and ``patches``, the hulls of the patches with ``patch``, ``vertices``, ``found``,
        ``score`` and ``recipient``.

    Raises
    ------
    ValueError
        When the report was made without ``evidence_map=True``.

    Examples
    --------
    >>> import geopandas, meshmark, shapely
    >>> houses = [shapely.box(20 * x, 20 * y, 20 * x + 9 + (x * y) % 5, 20 * y + 8) for x in range(20) for y in range(20)]
    >>> town = geopandas.GeoDataFrame(geometry=houses, crs="EPSG:3067")
    >>> key = meshmark.Key.generate()
    >>> copy, record = meshmark.mark(town, key, recipient="ACME GmbH")
    >>> report = meshmark.verify(copy, town, key, record, evidence_map=True)
    >>> patches = meshmark.evidence_map(report)["patches"]
    >>> max(patches.attributes["score"]) > 3
    True
    """
    rows = report._evidence_rows()
    if rows is None:
        raise ValueError("the report has no evidence map: verify with evidence_map=True")
    vertices, has_displacements, patches = rows
    crs = report._crs.crs if report._crs is not None else None
    name = "vertex_displacements" if has_displacements else "matched_vertices"
    return {
        name: (_displacements if has_displacements else _vertices)(vertices, crs),
        "patches": _patches(patches, crs),
    }


def _vertices(rows, crs):
    points = shapely.points(numpy.array([at for at, *_ in rows]).reshape(-1, 2))
    attributes = {"patch": [patch for _, patch, _, _ in rows], "weight": [weight for _, _, weight, _ in rows]}
    return _layer(points, crs, attributes)


def _displacements(rows, crs):
    ends = numpy.array([(at, to) for at, _, _, (to, _) in rows]).reshape(-1, 2, 2)
    moved_m = numpy.array([moved_m for *_, (_, moved_m) in rows]).reshape(-1, 2)
    attributes = {
        "patch": [patch for _, patch, _, _ in rows],
        "dx_m": moved_m[:, 0].tolist(),
        "dy_m": moved_m[:, 1].tolist(),
        "moved_m": numpy.hypot(moved_m[:, 0], moved_m[:, 1]).tolist(),
        "weight": [weight for _, _, weight, _ in rows],
    }
    return _layer(shapely.linestrings(ends), crs, attributes)


def _patches(rows, crs):
    hulls = [shapely.MultiPoint(vertices).convex_hull for vertices, *_ in rows]
    attributes = {
        "patch": list(range(len(rows))),
        "vertices": [len(vertices) for vertices, *_ in rows],
        "found": [found for _, found, _, _ in rows],
        "score": [score for _, _, score, _ in rows],
        "recipient": [recipient for *_, recipient in rows],
    }
    return _layer(numpy.array(hulls, dtype=object), crs, attributes)


def _layer(geometries, crs, attributes):
    return Layer(shapely.to_wkb(geometries, output_dimension=2).tolist(), crs, attributes)
