"""What GEOS decides about geometries, well-known binary, as the extension asks it."""

import shapely


def are_valid(geometries):
    """Return which geometries are valid; what is no geometry is not."""
    return shapely.is_valid(shapely.from_wkb(geometries, on_invalid="ignore")).tolist()


def intersections(ones, others):
    """Return the intersection of each pair."""
    ones, others = (shapely.from_wkb(all, on_invalid="ignore") for all in (ones, others))
    return shapely.to_wkb(shapely.intersection(ones, others)).tolist()
