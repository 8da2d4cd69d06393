"""Folders of reviews, as far as two runs of one review have them alike."""

import json


def pictures_of(folder):
    return {path.name: path.read_bytes() for path in (folder / "pictures").iterdir()}


def results_of(folder):
    """All that is said, but for the hour and how long it took."""
    document = json.loads((folder / "review.json").read_text(encoding="utf-8"))
    for row in document["results"]:
        del row["seconds"]
    return {key: value for key, value in document.items() if key != "created"}
