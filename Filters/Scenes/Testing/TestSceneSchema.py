# SPDX-License-Identifier: BSD-3-Clause
"""The schema of scenes: the examples keep it, and it refuses what the reader refuses."""
import copy
import json
import os
import sys
import unittest
from pathlib import Path

try:
    import jsonschema
except ImportError:
    print("skipped: python3-jsonschema is not installed")
    sys.exit(77)

FOLDER = Path(os.environ.get("ECHORAMA_SOURCE_DIR", Path(__file__).resolve().parents[3])) / "Examples" / "scenes"
SCHEMA = json.loads((FOLDER / "echorama-scene-1.schema.json").read_text())
EXAMPLES = {path.name: json.loads(path.read_text()) for path in FOLDER.glob("*.json") if not path.name.endswith(".schema.json")}


class SceneSchema(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        jsonschema.Draft202012Validator.check_schema(SCHEMA)
        cls.validator = jsonschema.Draft202012Validator(SCHEMA)

    def test_examples_keep_it(self):
        self.assertTrue(EXAMPLES)
        for name, scene in EXAMPLES.items():
            with self.subTest(name):
                self.assertEqual([error.message for error in self.validator.iter_errors(scene)], [])

    def test_every_number_has_a_range_and_every_key_a_description(self):
        def walk(schema, place):
            if schema.get("type") in ("number", "integer") and not place.endswith("[]"):
                self.assertTrue({"minimum", "exclusiveMinimum"} & set(schema), place)
                self.assertTrue("maximum" in schema or place.lower().endswith("seed"), place)
            if schema.get("type") == "object" and "properties" in schema:
                self.assertIs(schema["additionalProperties"], False, place)
            for key, value in schema.get("properties", {}).items():
                self.assertTrue("description" in value or "const" in value, f"{place}.{key}")
                walk(value, f"{place}.{key}")
            for index, value in enumerate(schema.get("oneOf", [])):
                walk(value, f"{place}|{index}")
            for key in ("items", "additionalProperties"):
                if isinstance(schema.get(key), dict):
                    walk(schema[key], place + "[]")
        walk(SCHEMA, "scene")

    def test_it_refuses(self):
        scene = {"schema": "echorama-scene-1"}
        self.validator.validate(scene)
        ball = {"sphere": {"material": "liver"}}
        self.validator.validate({**scene, "tissue": [ball]})
        wrong = [
            {"schema": "echorama-scene-2"},
            {},
            {**scene, "sede": 1},
            {**scene, "seed": -1},
            {**scene, "seed": 1.5},
            {**scene, "probe": {"preset": "curvy"}},
            {**scene, "probe": {"elements": 1}},
            {**scene, "volume": {"spacingMm": 0}},
            {**scene, "tissue": [{}]},
            {**scene, "tissue": [{**ball, "box": {"material": "liver"}}]},
            {**scene, "tissue": [{"sphere": {}}]},
            {**scene, "tissue": [{"sphere": {"material": "liver", "radius": 0}}]},
            {**scene, "tissue": [{"sphere": {"material": "liver", "centre": [0, 1]}}]},
            {**scene, "tissue": [{"packing": {"fillFraction": 2}}]},
            {**scene, "tissue": [{"anatomy": {"spine": 1}}]},
            {**scene, "views": {"poses": []}},
            {**scene, "views": {"poses": [{}], "count": 3}},
            {**scene, "views": {"poses": [[[1, 0, 0], [0, 1, 0], [0, 0, 1]]]}},
            {**scene, "views": {"recording": {}}},
            {**scene, "materials": {"x": {"soundSpeed": 1}}},
        ]
        for bad in wrong:
            with self.subTest(json.dumps(bad)):
                self.assertFalse(self.validator.is_valid(bad))

    def test_a_misspelt_key_is_refused_wherever_it_is(self):
        def places(value, path=()):
            if isinstance(value, dict):
                yield path
                for key, item in value.items():
                    yield from places(item, path + (key,))
            elif isinstance(value, list):
                for index, item in enumerate(value):
                    yield from places(item, path + (index,))
        for name, scene in EXAMPLES.items():
            for path in places(scene):
                if path and (path[-1] == "materials"):
                    continue  # its keys are names
                bad = copy.deepcopy(scene)
                target = bad
                for step in path:
                    target = target[step]
                target["misspelt"] = 1
                with self.subTest(f"{name}: {path}"):
                    self.assertFalse(self.validator.is_valid(bad))


if __name__ == "__main__":
    unittest.main()
