"""Runs the examples in the docstrings of the installed wheel."""

import doctest
import sys

import meshmark
from meshmark import _comparison, _distribution, _evidence, _layers, _verification

modules = (meshmark, _comparison, _distribution, _evidence, _layers, _verification)
results = [doctest.testmod(module) for module in modules]
print(f"Python {sys.version.split()[0]}: {sum(result.attempted for result in results)} examples")
sys.exit(any(result.failed for result in results))
