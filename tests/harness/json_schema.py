"""The JSON Schemas that the documents have, as far as they use it."""

import json
import re
from pathlib import Path

DOCS = Path(__file__).resolve().parents[2] / "docs"


def schemas(name: str) -> list[dict]:
    """Every schema in a document, in its order."""
    text = (DOCS / name).read_text(encoding="utf-8")
    return [json.loads(found) for found in re.findall(r"```json\n(.*?)```", text, re.S)]


def problems(value, schema, at="$") -> list[str]:
    """Find what of the JSON Schema a value breaks; the keywords that the documents use, and no others."""
    known = {
        "$schema", "type", "required", "properties", "items", "additionalProperties", "const", "enum", "minimum",
        "exclusiveMinimum",
    }  # fmt: skip
    assert set(schema) <= known, f"{at}: {set(schema) - known}"
    kinds = {
        "object": dict,
        "array": list,
        "string": str,
        "number": (int, float),
        "integer": int,
        "boolean": bool,
    }
    found = []
    names = schema.get("type", [])
    names = [names] if isinstance(names, str) else names
    fits = [value is None if name == "null" else isinstance(value, kinds[name]) for name in names]
    if names and (not any(fits) or (isinstance(value, bool) and "boolean" not in names)):
        return [f"{at}: {value!r} is no {names}"]
    if "const" in schema and value != schema["const"]:
        found.append(f"{at}: {value!r}")
    if "enum" in schema and value not in schema["enum"]:
        found.append(f"{at}: {value!r}")
    if isinstance(value, dict):
        found += [f"{at}: no {name}" for name in schema.get("required", []) if name not in value]
        for name, inner in value.items():
            rule = schema.get("properties", {}).get(name, schema.get("additionalProperties", {}))
            found += problems(inner, rule, f"{at}.{name}")
    if isinstance(value, list):
        for index, inner in enumerate(value):
            found += problems(inner, schema.get("items", {}), f"{at}[{index}]")
    if "minimum" in schema and value < schema["minimum"]:
        found.append(f"{at}: {value}")
    if "exclusiveMinimum" in schema and value <= schema["exclusiveMinimum"]:
        found.append(f"{at}: {value}")
    return found
