"""Hashes of code by its syntax tree: results stay valid through a better sentence, another layout or another file name.

Comments, docstrings and imports for types do not count. An imported module counts by its own hash in place of its name,
so that modules may be renamed and moved; functions, classes and everything else count by name and content.
"""

from __future__ import annotations

import ast
import hashlib
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from graphlib import TopologicalSorter
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from .disk_cache import cache_folder
from .errors import InputError
from .files import made_folder, written_whole

# Stands in dumps of syntax for the imports of a block, by number, or for an imported name.
_MARK = re.compile(r"Name\('<(\w+)>'")
# Hashes that are kept, of as many states of the code: 64 bytes each.
_MOST_KEPT = 200


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


def release(library: str, parts: int | None = None) -> str:
    """Return a library's name and the first `parts` numbers of its version, as "numpy 2.1"; all without `parts`."""
    try:
        return f"{library} {'.'.join(version(library).split('.')[:parts])}"
    except PackageNotFoundError:
        return f"{library} is not installed"


def syntax_hash(sources: Mapping[str, bytes]) -> str:
    """Compute the SHA-256 of modules that belong together, whatever they are called; kept on disk by their texts.

    Parameters
    ----------
    sources : texts by place, as "materials/fitting/fit" or "materials/__init__". Imports of modules that are not among
        them count by the imported names alone.

    Raises
    ------
    SyntaxError : a text is no Python.
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
        for old in sorted(kept.parent.iterdir(), key=lambda file: file.stat().st_mtime)[:-_MOST_KEPT]:
            old.unlink()
    return found


def _computed(sources: Mapping[str, bytes]) -> str:
    modules = {place: _module("/".join(place.split("/")[:-1]), text) for place, text in sources.items()}
    imports = {place: [_resolved(each, sources) for each in module.imports] for place, module in modules.items()}
    digests: dict[str, str] = {"": ""}
    graph = {place: {target for target, _ in found if target} for place, found in imports.items()}
    for place in TopologicalSorter(graph).static_order():
        found = [(digests[target], name) for target, name in imports[place]]
        digests[place] = _sha(modules[place].with_digests(found))
    return _sha("".join(sorted(set(digests.values()))))


@dataclass(frozen=True)
class _Import:
    """One name of a relative import, from `base`, in the block of statements number `body`."""

    body: int
    base: str
    name: str
    alias: str


@dataclass(frozen=True)
class _Module:
    """Syntax of a module without docstrings and imports for types, with marks for relative imports and their names.

    syntax : a dump of its tree. imports : in the order of its blocks.
    """

    syntax: str
    imports: tuple[_Import, ...]

    def with_digests(self, found: Sequence[tuple[str, str]]) -> str:
        """Return the syntax with imports put in by (digest of the module, name in it or "" for the module itself)."""
        lines: dict[int, list[str]] = {}
        names: dict[str, str] = {}
        for each, (digest, name) in zip(self.imports, found, strict=True):
            lines.setdefault(each.body, []).append(f"{digest} {name} {each.alias}" if name else digest)
            names[each.alias] = each.alias if name else digest

        def put_in(mark: re.Match[str]) -> str:
            word = mark[1]
            # Sorted, since imports are in the order of the modules' names.
            return f"Name({sorted(lines[int(word)]) if word.isdigit() else names[word]!r}"

        return _MARK.sub(put_in, self.syntax)


def _resolved(found: _Import, sources: Mapping[str, bytes]) -> tuple[str, str]:
    """Return the place of the module that a name comes from ("" elsewhere) and the name in it ("" for the module)."""
    for base, name in ((f"{found.base}/{found.name}", ""), (found.base, found.name)):
        for place in (base.strip("/"), f"{base}/__init__".strip("/")):
            if place in sources:
                return place, name
    return "", found.name


@lru_cache(maxsize=1024)
def _module(folder: str, text: bytes) -> _Module:
    """Parse the text of a module in a folder."""
    tree = ast.parse(text)
    names: list[ast.Name] = []
    imports: list[_Import] = []
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Name):
            names.append(node)
        for part in ("body", "orelse", "finalbody"):
            body = getattr(node, part, None)
            if isinstance(body, list):
                number = len(imports)
                imports += (found for each in body for found in _imports(folder, each, number))
                body[:] = [each for each in body if not _is_dropped(each)]
                if len(imports) > number:
                    body.insert(0, ast.Expr(ast.Name(f"<{number}>")))
        waiting += ast.iter_child_nodes(node)
    aliases = {found.alias for found in imports}
    for each in names:
        if each.id in aliases:
            each.id = f"<{each.id}>"
    return _Module(ast.dump(tree, annotate_fields=False), tuple(imports))


def _imports(folder: str, node: ast.stmt, body: int) -> Iterator[_Import]:
    """Yield the names of a relative import."""
    if isinstance(node, ast.ImportFrom) and node.level:
        folders = folder.split("/") if folder else []
        words = [*folders[: len(folders) + 1 - node.level], *(node.module or "").split(".")]
        for name in node.names:
            yield _Import(body, "/".join(words).strip("/"), name.name, name.asname or name.name)


def _is_dropped(node: ast.stmt) -> bool:
    """Return True for relative imports, docstrings and imports for types."""
    if isinstance(node, ast.Expr):
        return isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    if isinstance(node, ast.If):
        return isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
    return isinstance(node, ast.ImportFrom) and node.level > 0


def _sha(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
