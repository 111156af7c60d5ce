#!/usr/bin/env python3
"""Zips the plugin as QGIS installs it: make_zip.py FOLDER ZIP. Equal sources make equal bytes."""

import pathlib
import sys
import zipfile

# The earliest time a zip can hold.
NO_TIME = (1980, 1, 1, 0, 0, 0)

folder, target = map(pathlib.Path, sys.argv[1:])
licences = sorted(folder.parent.parent.glob("LICENSE-*"))
sources = sorted(path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
target.parent.mkdir(parents=True, exist_ok=True)
with zipfile.ZipFile(target, "w") as archive:
    for path, name in [(path, path.name) for path in licences] + [(p, p.relative_to(folder)) for p in sources]:
        entry = zipfile.ZipInfo(f"{folder.name}/{pathlib.PurePath(name).as_posix()}", NO_TIME)
        entry.external_attr = 0o644 << 16
        entry.compress_type = zipfile.ZIP_DEFLATED
        archive.writestr(entry, path.read_bytes())
print(f"{target}: install it in QGIS by Plugins > Manage and Install Plugins > Install from ZIP")
