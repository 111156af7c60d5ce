"""What the two engines of verification are asked for; all paths and texts are empty where they are not given."""

from collections import namedtuple

# `records` is the folder of all records, for which `record` takes precedence; `evidence` and `report` are files to
# write, and `is_exact` asks for the exact displacements of vertices in them.
Verification = namedtuple("Verification", "reference suspect key record records evidence report is_exact")

# `layers` are names, separated by commas, `precision` CRS units or None.
Comparison = namedtuple("Comparison", "original marked layers precision report")
