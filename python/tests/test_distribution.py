"""Distribution: the copies of each marking alone, bit for bit."""

import unittest
import warnings

import meshmark
import shapely

from test_marking import Folder, town
from test_verification import marked


class Distribution(Folder):
    def check(self, recipients, **options):
        reference = town()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            made = list(meshmark.distribute({"houses": reference}, self.key, recipients, **options))
        self.assertEqual([recipient for recipient, _, _ in made], recipients)
        for recipient, copies, record in made:
            alone, own = marked({"houses": reference}, self.key, recipient=recipient, **options)
            self.assertEqual(record.to_json(), own.to_json())
            found, expected = (shapely.to_wkb(layers["houses"].geometry.array) for layers in (copies, alone))
            self.assertTrue((found == expected).all())
            self.assertTrue(copies["houses"]["number"].equals(reference["number"]))

    def test_fingerprints_of_more_than_a_batch(self):
        self.check([f"recipient {number}" for number in range(18)])

    def test_messages(self):
        self.check(["ACME GmbH", "Example Ltd"], code="LDPC")

    def test_what_is_refused_is_refused_at_once(self):
        reference = town()
        for recipients, error, text in [
            ("ACME", TypeError, "and not a list of texts"),
            (["A", 7], TypeError, "recipient is 7, a int, and not a text"),
            (["A", None], TypeError, "a recipient is None"),
            (["A", "B", "A"], ValueError, "recipient 'A' is named twice"),
        ]:
            with self.assertRaisesRegex(error, text):
                meshmark.distribute(reference, self.key, recipients)
        for recipients, text in [
            (["A", "B\n"], "recipient=B.* has a line break or another control character: remove it"),
            ([" A"], "recipient= A begins or ends with a blank: remove it"),
            (["Caf\u00e9", "Cafe\u0301"], "is there in two spellings of Unicode"),
        ]:
            with self.assertRaisesRegex(meshmark.OptionError, text):
                meshmark.distribute(reference, self.key, recipients)
        with self.assertWarnsRegex(UserWarning, "the decomposed form of Unicode"):
            meshmark.distribute(reference, self.key, ["A", "Cafe\u0301"])
        self.assertEqual(list(meshmark.distribute(reference, self.key, [])), [])
        with self.assertRaisesRegex(TypeError, "distribute\\(\\) has no option colour"):
            meshmark.distribute(reference, self.key, ["A"], colour="red")
        with self.assertRaises(meshmark.OptionError):
            list(meshmark.distribute(reference, self.key, ["A", ""]))


if __name__ == "__main__":
    unittest.main()
