"""Code stays the same in other words and under other file names, and becomes another where it computes otherwise."""

import ast
import json
import shutil
from types import SimpleNamespace

import pytest
from metamer.runtime import code_hash
from metamer.runtime.code_hash import files_hash, syntax_hash
from metamer.runtime.disk_cache import cache_folder

MAIN = b'''"""Doubles numbers."""

from . import numbers_of_files
from .first import double
from .second import half as smaller

if TYPE_CHECKING:
    from .first import Number


class Doubler:
    """A factor of two."""

    def twice(self, x: Number) -> Number:
        """Double x."""
        from .deep.third import add

        # Half of four times.
        return add(smaller(double(double(x))), numbers_of_files.NOTHING)
'''
FIRST = b"def double(x):\n    return 2 * x\n\n\ndef half(x):\n    return x / 2\n"
SECOND = b"def double(x):\n    return x + x\n\n\ndef half(x):\n    return 0.5 * x\n"
SOURCES = {
    "__init__": b"",
    "main": MAIN,
    "first": FIRST,
    "second": SECOND,
    "deep/__init__": b'"""What is deep."""\n',
    "deep/third": b"from ..first import half\n\n\ndef add(x, y):\n    return half(2 * (x + y))\n",
    "numbers_of_files": b"NOTHING = 0\n",
}


def rewritten(place, old, new):
    assert old in SOURCES[place]
    return SOURCES | {place: SOURCES[place].replace(old, new)}


def renamed(before, after):
    """Give a module another name, here and where it is imported."""
    old, new = (name.rpartition("/")[2].encode() for name in (before, after))
    path = {name: name.replace("/", ".").encode() for name in (before, after)}
    found = {}
    for place, text in SOURCES.items():
        text = text.replace(b"from ." + path[before], b"from ." + path[after])
        text = text.replace(b"from .." + path[before], b"from .." + path[after])
        text = text.replace(b"import " + old, b"import " + new).replace(old + b".", new + b".")
        found[after if place == before else place] = text
    assert found.keys() != SOURCES.keys()
    return found


@pytest.mark.parametrize(
    "other",
    [
        rewritten("main", b"Doubles numbers.", b"Multiplies numbers by two."),
        rewritten("main", b"A factor of two.", b"A factor."),
        rewritten("main", b'        """Double x."""\n', b""),
        rewritten("main", b"        # Half of four times.\n", b""),
        rewritten("main", b"\n\n\nclass", b"\n\nclass"),
        rewritten("main", b"    from .first import Number", b"    from .second import Number"),
        rewritten("first", b"2 * x", b"(2 * x)  # twice"),
        rewritten("deep/__init__", b"What is deep.", b"Sums."),
        renamed("first", "zeroth"),
        renamed("numbers_of_files", "constants"),
        renamed("deep/third", "deep/sums"),
        dict(reversed(SOURCES.items())),
    ],
)
def test_words_layout_order_and_names_of_modules_do_not_count(other):
    assert syntax_hash(other) == syntax_hash(SOURCES)


def test_a_module_may_move_to_another_folder():
    other = rewritten("main", b".deep.third", b".sums")
    other["sums"] = other.pop("deep/third").replace(b"from ..first", b"from .first")
    assert syntax_hash(other) == syntax_hash(SOURCES)


@pytest.mark.parametrize(
    "other",
    [
        rewritten("first", b"2 * x", b"2 + x"),
        rewritten("first", b"2 * x", b"2.0 * x"),
        rewritten("first", b"def half", b"def halved"),
        rewritten("numbers_of_files", b"0", b"'0'"),
        rewritten("main", b"from .first import double", b"from .second import double"),
        rewritten("main", b"half as smaller", b"double as smaller"),
        rewritten("main", b"from .deep.third import add", b"from .first import half as add"),
        rewritten("main", b"numbers_of_files.NOTHING", b"numbers_of_files.ONE"),
        rewritten("deep/third", b"from ..first", b"from ..second"),
        SOURCES | {"fourth": b"ONE = 1\n"},
    ],
)
def test_anything_that_is_computed_counts(other):
    assert syntax_hash(other) != syntax_hash(SOURCES)


def test_functions_of_one_name_in_two_modules_are_told_apart_where_both_are_used():
    function = b"def %s(x):\n    from .%s import half\n    return half(x)\n"
    text = function % (b"a", b"first") + function % (b"b", b"second")
    swapped = text.replace(b".first", b".x").replace(b".second", b".first").replace(b".x", b".second")
    assert syntax_hash(SOURCES | {"both": text}) != syntax_hash(SOURCES | {"both": swapped})


def test_hashes_are_kept_and_damaged_ones_computed_again(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    found = syntax_hash(SOURCES)
    (file,) = cache_folder("code").iterdir()
    file.write_text("0" * 64)
    assert syntax_hash(SOURCES) == "0" * 64
    for damaged in ("", "0" * 63, "ü" * 64):
        file.write_text(damaged, encoding="utf-8")
        assert syntax_hash(SOURCES) == found


def test_only_modules_that_changed_are_parsed_again(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    texts = []

    def parse(text):
        texts.append(text)
        return ast.parse(text)

    monkeypatch.setattr(code_hash, "ast", SimpleNamespace(**vars(ast) | {"parse": parse}))
    found = syntax_hash(SOURCES)
    assert len(texts) == len(SOURCES)
    other = syntax_hash(rewritten("first", b"2 * x", b"2 + x"))
    assert texts[len(SOURCES) :] == [b"def double(x):\n    return 2 + x\n\n\ndef half(x):\n    return x / 2\n"]
    shutil.rmtree(cache_folder("code"))
    assert (syntax_hash(SOURCES), syntax_hash(rewritten("first", b"2 * x", b"2 + x"))) == (found, other)
    assert len(texts) == len(SOURCES) + 1


@pytest.mark.parametrize("damage", ["", "[]", "{}", "null", "{", "ü", '{"%s": 3}', '{"%s": ["a", [[["b"]]], []]}'])
def test_modules_that_were_kept_and_are_damaged_are_parsed_again(tmp_path, monkeypatch, damage):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    found = syntax_hash(SOURCES)
    (file,) = cache_folder("syntax").iterdir()
    keys = json.loads(file.read_text())
    for key in keys if "%s" in damage else [""]:
        file.write_text(damage.replace("%s", key), encoding="utf-8")
        shutil.rmtree(cache_folder("code"))
        assert syntax_hash(SOURCES) == found


def test_where_nothing_can_be_kept_hashes_are_computed(tmp_path, monkeypatch):
    (tmp_path / "metamer").write_text("a file")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert syntax_hash(SOURCES) == syntax_hash(SOURCES)


def test_files_that_are_no_python_and_libraries_count(tmp_path):
    files = [tmp_path / "fold.glsl", tmp_path / "fold.py"]
    for file in files:
        file.write_text("x = 1\n")
    found = files_hash(tmp_path, files)
    files[0].write_text("x = 2\n")
    assert len({found, files_hash(tmp_path, files), files_hash(tmp_path, files, ["numpy"])}) == 3
    assert files_hash(tmp_path, files, ["no-such-library"]) != files_hash(tmp_path, files)
