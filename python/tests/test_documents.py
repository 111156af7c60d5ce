"""The Python of the documents works as it stands there."""

import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]


class Documents(unittest.TestCase):
    def test_what_the_documents_do_verifies(self):
        script = "".join(
            block
            for document in ("docs/python.md", "README.md")
            for block in re.findall(r"^```python\n(.*?)^```", (ROOT / document).read_text(), re.S | re.M)
        )
        self.assertEqual(script.count("meshmark.mark("), 2)
        before = os.getcwd()
        self.addCleanup(os.chdir, before)
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            shutil.copy(ROOT / "fixtures" / "helsinki.gpkg", "map.gpkg")
            exec(compile(script, "documents", "exec"), {})
            command = [ROOT / "target" / "release" / "meshmark", "verify", "--key", "key.json"]
            command += ["--reference", "reference.gpkg", "--record", "acme.json", "acme.gpkg"]
            verified = subprocess.run(command, capture_output=True, text=True)
            self.assertEqual(verified.returncode, 0, verified.stdout + verified.stderr)
            os.chdir(before)


if __name__ == "__main__":
    unittest.main()
