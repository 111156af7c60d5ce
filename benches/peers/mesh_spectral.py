"""The paper's method, written with numpy; `make bench` compares the driver with it.

python3 mesh_spectral.py INPUT OUTPUT SEED

Marks the vertices of every layer with 128 bits, repeated by two processes of one BLAS thread each. Ohbuchi, Ueda, Endoh 2003:
Delaunay mesh, k-d split, Biggs Laplacian, spectral coefficients changed by alpha times chip times bit. It keeps no
topology, holds no tolerance, reads nothing back, and writes no record.
"""

import multiprocessing
import os
import sys

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # before numpy is imported

import geopandas
import numpy as np
import pyogrio
import shapely
from scipy.spatial import Delaunay

PROCESSES = 2
PATCH_SIZE = 480
BITS = 128
CHIP_RATE = 2
AMPLITUDE_M = 0.10


def split(points, indices, parts, found):
    """Halves the longer side until a part has about PATCH_SIZE vertices."""
    if parts <= 1:
        found.append(indices)
        return
    axis = np.argmax(np.ptp(points[indices], axis=0))
    left = parts // 2
    middle = len(indices) * left // parts
    order = indices[np.argpartition(points[indices, axis], middle)]
    split(points, order[:middle], left, found)
    split(points, order[middle:], parts - left, found)


def edges_of(points):
    triangles = Delaunay(points - points.mean(axis=0)).simplices
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    return np.unique(np.sort(pairs, axis=1), axis=0)


def displacement(job):
    """Returns n × 2 metres for a patch of n vertices, given by its number, size and edges."""
    seed, number, size, edges, bits = job
    adjacency = np.zeros((size, size))
    adjacency[edges[:, 0], edges[:, 1]] = adjacency[edges[:, 1], edges[:, 0]] = 1.0
    degrees = np.maximum(adjacency.sum(axis=1), 1.0)
    root = 1.0 / np.sqrt(degrees)
    laplacian = np.eye(size) - root[:, None] * adjacency * root[None, :]
    _, vectors = np.linalg.eigh(laplacian)
    basis = root[:, None] * vectors[:, 1 : 1 + BITS * CHIP_RATE]
    basis /= np.linalg.norm(basis, axis=0)
    chips = np.random.default_rng([seed, number]).choice([-1.0, 1.0], size=(basis.shape[1], 2))
    return AMPLITUDE_M * basis @ (chips * np.repeat(bits, CHIP_RATE)[:, None])


def mark(vertices, seed):
    """Returns the new places of the vertices."""
    bits = np.random.default_rng(seed).choice([-1.0, 1.0], size=BITS)
    parts = []
    split(vertices, np.arange(len(vertices)), len(vertices) // PATCH_SIZE, parts)
    patch, row = np.empty(len(vertices), int), np.empty(len(vertices), int)
    for number, part in enumerate(parts):
        patch[part], row[part] = number, np.arange(len(part))
    edges = edges_of(vertices)
    edges = edges[patch[edges[:, 0]] == patch[edges[:, 1]]]
    edges = edges[np.argsort(patch[edges[:, 0]], kind="stable")]
    ends = np.searchsorted(patch[edges[:, 0]], np.arange(len(parts) + 1))
    jobs = (
        (seed, number, len(part), row[edges[ends[number] : ends[number + 1]]], bits)
        for number, part in enumerate(parts)
    )
    moved = vertices.copy()
    with multiprocessing.Pool(PROCESSES) as pool:
        for part, moves in zip(parts, pool.imap(displacement, jobs, chunksize=8)):
            moved[part] += moves
    return moved


def main(source, target, seed):
    names = [name for name, kind in pyogrio.list_layers(source) if kind is not None]
    layers = [geopandas.read_file(source, layer=name, engine="pyogrio") for name in names]
    coordinates = [shapely.get_coordinates(layer.geometry.values) for layer in layers]
    vertices, where = np.unique(np.concatenate(coordinates), axis=0, return_inverse=True)
    moved = mark(vertices, seed)[where.reshape(-1)]
    start = 0
    for name, layer, old in zip(names, layers, coordinates):
        new = moved[start : start + len(old)]
        start += len(old)
        layer = layer.set_geometry(shapely.set_coordinates(layer.geometry.values.copy(), new), crs=layer.crs)
        layer.to_file(target, layer=name, driver="GPKG", engine="pyogrio")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
