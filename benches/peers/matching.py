"""Times the matching by SciPy's k-d tree: for two sets of points, the nearest of each in the other.

arguments: radius, repetitions
stdin:     two sets of N points as f64 x, f64 y, one after the other
stdout:    seconds of all repetitions together
"""

import sys
import time

import numpy as np
from scipy.spatial import cKDTree

radius, repetitions = float(sys.argv[1]), int(sys.argv[2])
one, other = np.frombuffer(sys.stdin.buffer.read()).reshape(2, -1, 2)
start = time.perf_counter()
for _ in range(repetitions):
    trees = cKDTree(one), cKDTree(other)
    trees[1].query(one, distance_upper_bound=radius)
    trees[0].query(other, distance_upper_bound=radius)
print(time.perf_counter() - start)
