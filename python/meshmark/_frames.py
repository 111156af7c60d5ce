"""GeoDataFrames as layers of well-known binary, and back."""

import shapely

from ._crs import Crs


class Layer:
    """A geometry column of a layer, as the extension takes it."""

    def __init__(self, name, series):
        self.name = name
        self.geometries = shapely.to_wkb(
            series.to_numpy(), output_dimension=4, byte_order=1, flavor="iso"
        ).tolist()
        self.crs = Crs(series.crs) if series.crs is not None else None
        self._index = series.index

    def fid(self, number):
        """Return the name of a feature for messages."""
        return str(self._index[number])


def layers_of(frames):
    """Return every geometry column of frames, a dict by the names of the layers."""
    return [
        Layer(name, frame[column])
        for name, frame in frames.items()
        for column in _geometry_columns(frame)
    ]


def moved(frames, geometries):
    """Return copies of frames with the geometries of all columns that `layers_of` returns."""
    geometries = iter(geometries)
    copies = {}
    for name, frame in frames.items():
        copy = frame.copy()
        for column in _geometry_columns(frame):
            array = shapely.from_wkb(next(geometries))
            copy[column] = type(frame[column])(array, index=frame.index, crs=frame[column].crs)
        copies[name] = copy
    return copies


def _geometry_columns(frame):
    return [column for column, dtype in frame.dtypes.items() if str(dtype) == "geometry"]
