"""The CRS of a layer, as the extension takes it."""

import math

import pyproj


class Crs:
    """A CRS with x = easting or longitude and y = northing or latitude."""

    def __init__(self, crs):
        self.crs = pyproj.CRS(crs)
        self.kind = _kind(self.crs)
        identifier = self.crs.to_json_dict().get("id")
        code = f"{identifier['authority']}:{identifier['code']}" if identifier else None
        self.label = code or self.crs.to_wkt("WKT1_GDAL")
        self.name = code or self.crs.name
        self.linear_units_m = 1.0 if self.kind == "geographic" else _unit(self.crs)
        geodetic = self.crs.geodetic_crs
        self.radians_per_unit = _unit(geodetic) if geodetic else 1.0
        ellipsoid = self.crs.ellipsoid
        self.ellipsoid_m = (
            [ellipsoid.semi_major_metre, ellipsoid.semi_minor_metre] if ellipsoid else None
        )
        self._transformers = {}

    @property
    def geographic(self):
        """The CRS of longitudes and latitudes on its datum; None without one."""
        geodetic = self.crs.geodetic_crs
        return Crs(geodetic) if geodetic is not None else None

    @property
    def prime_meridian_degrees(self):
        """Degrees from Greenwich to the prime meridian."""
        meridian = self.crs.prime_meridian
        return math.degrees(meridian.longitude * meridian.unit_conversion_factor) if meridian else 0.0

    def is_same(self, other):
        """Return whether two have the same x and y."""
        return self.crs.equals(other.crs, ignore_axis_order=True)

    def to_geographic(self, x, y):
        """Return longitudes and latitudes on the datum of the CRS; inf where there is no place."""
        if self.label == "EPSG:3857":
            return _of_web_mercator(x, y)
        return self._transformed(x, y, self.crs.geodetic_crs)

    def transform(self, x, y, target):
        """Return eastings and northings, or longitudes and latitudes, in another CRS; inf where there is no place."""
        if self.label == "EPSG:3857" and target.label in ("EPSG:4326", "OGC:CRS84"):
            return _of_web_mercator(x, y)
        return self._transformed(x, y, target.crs)

    def _transformed(self, x, y, target):
        if target not in self._transformers:
            self._transformers[target] = pyproj.Transformer.from_crs(self.crs, target, always_xy=True)
        return self._transformers[target].transform(x, y)


def parse(text):
    """Return the CRS of a text such as "EPSG:3067"; None for one that PROJ does not know."""
    try:
        return Crs(text)
    except pyproj.exceptions.CRSError:
        return None


def _kind(crs):
    if crs.is_geocentric:
        return "geocentric"
    if crs.is_geographic:
        return "geographic"
    return "projected" if crs.is_projected else "other"


def _of_web_mercator(x, y):
    """Return what GDAL's driver computes, which does not leave this projection to PROJ."""
    per_metre, degrees = 1.0 / 6378137.0, 180.0 / math.pi

    def latitude(y):
        return (math.pi / 2 - 2 * math.atan(math.exp(min(-y * per_metre, 700.0)))) * degrees

    return [x * per_metre * degrees for x in x], [latitude(y) for y in y]


def _unit(crs):
    """Return metres or radians per unit."""
    axes = crs.axis_info
    return axes[0].unit_conversion_factor if axes else 1.0
