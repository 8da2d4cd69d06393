"""Hashes of code by its syntax tree, unchanged by comments, layout and file names.

Comments, docstrings and imports for types do not count. An imported module counts by its own hash in place of its name,
so that modules may be renamed and moved; functions, classes and everything else count by name and content.
"""

from __future__ import annotations

import ast
import hashlib
import json
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from graphlib import TopologicalSorter
from importlib.metadata import PackageNotFoundError, requires, version
from itertools import chain, islice
from pathlib import Path
from typing import Any, NamedTuple

from .disk_cache import cache_folder, keep_newest
from .distribution import DISTRIBUTION
from .errors import InputError
from .files import made_folder, written_whole

# Fields of syntax that say nothing more: how a name is used stands in where it is.
_IMPLIED = {"ctx", "kind", "type_comment"}
_BODIES = ("body", "orelse", "finalbody")
# Modules whose syntax is kept, some 400 bytes each.
_MOST_MODULES = 4000


def files_hash(root: Path, files: Iterable[Path], libraries: Iterable[str] = ()) -> str:
    """Compute the SHA-256 of code in files below `root`, Python by its syntax, and of the versions of libraries.

    libraries : names of distributions; one that is not installed counts as such.
    """
    modules: dict[str, bytes] = {}
    others = []
    for file in files:
        if file.suffix == ".py":
            modules[file.relative_to(root).with_suffix("").as_posix()] = file.read_bytes()
        else:
            others.append(hashlib.sha256(file.read_bytes()).hexdigest())
    return _sha("\n".join([syntax_hash(modules), *sorted(others), *map(release, libraries)]))


@cache
def product_hash(folders: tuple[str, ...], suffixes: tuple[str, ...] = (".py",)) -> str:
    """Compute the SHA-256 of the code in some of our folders, and of the versions of all required libraries."""
    root = Path(__file__).parents[1]
    files = [path for name in folders for path in (root / name).rglob("*") if path.suffix in suffixes]
    lines = (line for line in requires(DISTRIBUTION) or () if "extra ==" not in line)
    return files_hash(root, files, sorted(re.split(r"[^\w.-]", line)[0] for line in lines))


def release(library: str, parts: int | None = None) -> str:
    """Return a library's name and the first `parts` numbers of its version, as "numpy 2.1"; all without `parts`."""
    try:
        return f"{library} {'.'.join(version(library).split('.')[:parts])}"
    except PackageNotFoundError:
        return f"{library} is not installed"


def syntax_hash(sources: Mapping[str, bytes]) -> str:
    """Compute the SHA-256 of a group of modules, independent of their names; cached on disk by their texts.

    Parameters
    ----------
    sources : texts by place, as "materials/fitting/fit" or "materials/__init__". Imports of modules that are not among
        them count by the imported names alone.

    Raises
    ------
    SyntaxError : a text is not Python.
    graphlib.CycleError : modules import each other.
    """
    texts = "".join(f"|{place}|{hashlib.sha256(sources[place]).hexdigest()}" for place in sorted(sources))
    kept = cache_folder("code") / _sha(f"{sys.version_info[:2]}{texts}")
    with suppress(OSError, ValueError):
        found = kept.read_text("ascii")
        if len(found) == len(kept.name):
            return found
    found = _computed(sources)
    with suppress(InputError, OSError):
        made_folder(kept.parent)
        with written_whole(kept) as beside:
            beside.write_text(found, "ascii")
        keep_newest(kept.parent)
    return found


def _computed(sources: Mapping[str, bytes]) -> str:
    modules = _modules(sources)
    imports = {place: [_resolved(each, sources) for each in module.imports] for place, module in modules.items()}
    digests: dict[str, str] = {"": ""}
    graph = {place: {target for target, _ in found if target} for place, found in imports.items()}
    for place in TopologicalSorter(graph).static_order():
        found = [(digests[target], name) for target, name in imports[place]]
        digests[place] = modules[place].with_digests(found)
    return _sha("".join(sorted(set(digests.values()))))


def _modules(sources: Mapping[str, bytes]) -> dict[str, _Module]:
    """Return the modules by place; previously parsed ones are read from disk, by their texts."""
    file = cache_folder("syntax") / "modules.json"
    known: dict[str, list[Any]] = {}
    with suppress(OSError, ValueError, AttributeError):
        known = dict(json.loads(file.read_text("ascii")).items())
    found: dict[str, _Module] = {}
    parsed: dict[str, list[Any]] = {}
    for place, text in sources.items():
        folder = "/".join(place.split("/")[:-1])
        key = _sha(f"{sys.version_info[:2]}|{folder}|{hashlib.sha256(text).hexdigest()}")
        try:
            found[place] = _Module.from_stored(known[key])
        except (KeyError, TypeError, ValueError):
            found[place] = _parsed(folder, text)
            parsed[key] = found[place].stored()
    if parsed:
        kept = list((known | parsed).items())[-_MOST_MODULES:]
        with suppress(InputError, OSError):
            made_folder(file.parent)
            with written_whole(file) as beside:
                beside.write_text(json.dumps(dict(kept)), "ascii")
    return found


class _Import(NamedTuple):
    """One name of a relative import from `base`."""

    base: str
    name: str
    alias: str


@dataclass(frozen=True)
class _Module:
    """Syntax of a module without docstrings and imports for types, and its relative imports.

    digest : of its tree, in which blocks of statements with imports and imported names are numbered as they come.
    blocks : imports of each of these blocks. names : alias of each of these names.
    """

    digest: str
    blocks: tuple[tuple[_Import, ...], ...]
    names: tuple[str, ...]

    @property
    def imports(self) -> Iterator[_Import]:
        """Imports of all blocks, in order."""
        return chain.from_iterable(self.blocks)

    def stored(self) -> list[Any]:
        """Return the input of `from_stored`."""
        return [self.digest, self.blocks, self.names]

    @classmethod
    def from_stored(cls, stored: list[Any]) -> _Module:
        """Make the module from `stored`.

        Raises
        ------
        TypeError, ValueError : an invalid one.
        """
        digest, blocks, names = stored
        if not all(isinstance(word, str) for word in (digest, *names, *chain(*chain(*blocks)))):
            raise TypeError(stored)
        return cls(digest, tuple(tuple(_Import(*each) for each in block) for block in blocks), tuple(names))

    def with_digests(self, found: Sequence[tuple[str, str]]) -> str:
        """Hash the syntax with each import as (digest of the module, name in it or "" for the module itself)."""
        pairs = list(zip(self.imports, found, strict=True))
        names = {each.alias: each.alias if name else digest for each, (digest, name) in pairs}
        words = iter(f"{digest} {name} {each.alias}" if name else digest for each, (digest, name) in pairs)
        # Sorted, since imports are in the order of the modules' names.
        lines = [sorted(islice(words, len(block))) for block in self.blocks]
        return _sha(f"{self.digest} {lines} {[names[alias] for alias in self.names]}")


def _resolved(found: _Import, sources: Mapping[str, bytes]) -> tuple[str, str]:
    """Return the place of the module that a name comes from ("" elsewhere) and the name in it ("" for the module)."""
    for base, name in ((f"{found.base}/{found.name}", ""), (found.base, found.name)):
        for place in (base.strip("/"), f"{base}/__init__".strip("/")):
            if place in sources:
                return place, name
    return "", found.name


def _parsed(folder: str, text: bytes) -> _Module:
    """Parse the text of a module in a folder."""
    words: list[str] = []
    blocks: list[tuple[_Import, ...]] = []
    names: list[int] = []

    def add(value: object) -> None:
        if isinstance(value, ast.AST):
            kind = type(value)
            words.append(kind.__name__)
            if kind is ast.Name:
                names.append(len(words))
                words.append(value.id)
                return
            for field in _fields(kind):
                part = getattr(value, field, None)
                add(without_imports(part) if field in _BODIES and isinstance(part, list) else part)
            words.append(")")
        elif isinstance(value, list):
            words.append("[")
            for each in value:
                add(each)
            words.append("]")
        else:
            words.append(repr(value))

    def without_imports(body: list[ast.stmt]) -> list[ast.stmt]:
        imports = tuple(found for each in body for found in _imports(folder, each))
        if imports:
            words.append(f"<{len(blocks)}>")
            blocks.append(imports)
        return [each for each in body if not _is_dropped(each)]

    add(ast.parse(text))
    aliases = {each.alias for each in chain.from_iterable(blocks)}
    marked = [place for place in names if words[place] in aliases]
    numbers: dict[str, int] = {}
    for place in marked:
        words[place] = f"<{numbers.setdefault(words[place], len(numbers))}>"
    return _Module(_sha("\n".join(words)), tuple(blocks), tuple(numbers))


@cache
def _fields(kind: type[ast.AST]) -> tuple[str, ...]:
    return tuple(field for field in kind._fields if field not in _IMPLIED)


def _imports(folder: str, node: ast.stmt) -> Iterator[_Import]:
    """Yield the names of a relative import."""
    if isinstance(node, ast.ImportFrom) and node.level:
        folders = folder.split("/") if folder else []
        words = [*folders[: len(folders) + 1 - node.level], *(node.module or "").split(".")]
        for name in node.names:
            yield _Import("/".join(words).strip("/"), name.name, name.asname or name.name)


def _is_dropped(node: ast.stmt) -> bool:
    """Return True for relative imports, docstrings and imports for types."""
    if isinstance(node, ast.Expr):
        return isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    if isinstance(node, ast.If):
        return isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
    return isinstance(node, ast.ImportFrom) and node.level > 0


def _sha(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
