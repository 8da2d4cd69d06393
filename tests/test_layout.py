"""The tree is what pyproject.toml and docs/architecture.md say it is."""

import ast
import fnmatch
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest
from patience import patient

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
SETUPTOOLS = PROJECT["tool"]["setuptools"]
# The packages below the outermost one, which is the root itself: of its own it has a few files that stand there.
FOLDERS = {name: ROOT.joinpath(*name.split(".")[1:]) for name in SETUPTOOLS["packages"] if name != "metamer"}
# Lines of a file, of the product and of its tests.
LONGEST, LONGEST_TEST = 600, 600
# Paths of one person's machine: nothing that is published may depend on it.
SOMEBODY_S_PATH = re.compile(r"(?<![\w.)\]}>*])/(?:home|Users|work|root|mnt)/\w|\b[A-Z]:\\+Users\\")


def tracked(*patterns):
    """Files that git tracks or would track, as paths from the root."""
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("not a git checkout: the list of files is git's")
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z", *patterns],
        cwd=ROOT,
        capture_output=True,
        check=True,
    ).stdout.decode()
    return [Path(name) for name in listed.split("\0") if name and (ROOT / name).is_file()]


@cache
def imports_from(path):
    """Find imports by `from` in a file, in functions and for types too."""
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    return [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]


@pytest.fixture(scope="module")
def trees():
    """Syntax trees of the product's files by their paths, benchmarks and examples too."""
    packages = {folder.relative_to(ROOT).parts[0] for folder in FOLDERS.values()}
    ours = (path for path in tracked("*.py") if path.parts[0] in packages or len(path.parts) == 1)
    return {path: ast.parse((ROOT / path).read_text(encoding="utf-8")) for path in ours}


def tool(name):
    """Path of a command that stands beside this Python; the test skips where it is not installed."""
    found = shutil.which(name, path=os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")]))
    if found is None:
        pytest.skip(f"{name} is not installed; it is in the extra `test`")
    return found


def clean(*command):
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=patient(300))
    assert done.returncode == 0, f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}"


def packages_in(folder, name):
    """Names of the packages below one folder, itself among them."""
    return {
        ".".join([name, *path.parent.relative_to(folder).parts])
        for path in folder.rglob("__init__.py")
        if "__pycache__" not in path.parts
    }


def test_declared_packages_are_those_of_the_tree():
    assert SETUPTOOLS["package-dir"] == {"metamer": "."} and SETUPTOOLS["packages"][0] == "metamer"
    declared = set(SETUPTOOLS["packages"]) - {"metamer"}
    outermost = {name: folder for name, folder in FOLDERS.items() if name.count(".") == 1}
    there = set().union(*(packages_in(folder, name) for name, folder in outermost.items()))
    assert there == declared, there ^ declared


def test_no_python_folder_is_left_undeclared():
    """A folder with Python in it belongs to a package, or is tests."""
    tops = {path.parts[0] for path in tracked("*.py") if len(path.parts) > 1}
    packages = {folder.relative_to(ROOT).parts[0] for folder in FOLDERS.values()}
    assert tops - packages <= {"tests"}


def test_every_file_in_a_package_is_installed_with_it():
    """Shaders, templates and catalogues match a pattern of package-data."""
    data = SETUPTOOLS["package-data"]
    missing = []
    for path in tracked():
        holders = [name for name, folder in FOLDERS.items() if (ROOT / path).is_relative_to(folder)]
        if not holders or path.suffix == ".py":
            continue
        patterns = [
            (FOLDERS[name].relative_to(ROOT) / pattern).as_posix() for name in holders for pattern in data.get(name, [])
        ]
        if not any(fnmatch.fnmatch(path.as_posix(), pattern.replace("**/*", "*")) for pattern in patterns):
            missing.append(path.as_posix())
    assert not missing, missing


def test_packages_import_their_own_relatively():
    """`from ..spectral.basis import ...` inside; `metamer.*` outside, in tests and examples."""
    folders = "|".join(sorted({folder.relative_to(ROOT).parts[0] for folder in FOLDERS.values()}))
    inside = re.compile(r"^\s*(?:from|import) metamer\b", re.M)
    outside = re.compile(rf"^\s*(?:from|import) (?:{folders})\b", re.M)
    wrong = []
    for path in tracked("*.py"):
        within = any((ROOT / path).is_relative_to(folder) for folder in FOLDERS.values())
        ours = len(path.parts) == 1 or (within and path.parts[0] != "examples")
        text = (ROOT / path).read_text(encoding="utf-8")
        if (inside if ours else outside).search(text):
            wrong.append(path.as_posix())
    assert not wrong, wrong


@pytest.mark.slow
def test_nothing_below_imports_the_outermost_package():
    """Its names are for scripts. What a fit can reach would else be everything: every change would fit all again."""
    below = {name.split(".")[1] for name in FOLDERS}
    beyond = []
    for path in tracked("*.py"):
        if path.parts[0] not in below:
            continue
        for node in imports_from(path):
            if node.level == len(path.parts):
                named = [node.module] if node.module else [name.name for name in node.names]
                beyond += [f"{path}:{node.lineno}" for name in named if name.split(".")[0] not in below]
    assert not beyond, beyond


def test_no_file_is_longer_than_a_room():
    lengths = {
        path.as_posix(): len((ROOT / path).read_text(encoding="utf-8").splitlines())
        for path in tracked("*.py", "*.glsl", "*.vert", "*.frag")
    }
    assert lengths
    too_long = {
        name: length
        for name, length in lengths.items()
        if length > (LONGEST_TEST if name.startswith("tests/") else LONGEST)
    }
    assert not too_long, too_long


def test_no_path_of_somebody_s_machine():
    found = []
    for path in tracked():
        try:
            text = (ROOT / path).read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        found += [f"{path}: {hit[0]}" for hit in SOMEBODY_S_PATH.finditer(text)]
    assert not found, found


def test_the_pattern_of_paths_knows_one():
    for sample in ("open('" + "/ho" + "me/ann/a.csv')", "see " + "/Us" + "ers/ann", "C:" + "\\Users\\ann"):
        assert SOMEBODY_S_PATH.search(sample), sample
    for sample in ("https://example.org/home/a", "shared/work/a", "a /work b"):
        assert not SOMEBODY_S_PATH.search(sample), sample


def test_a_hint_to_install_metamer_has_its_own_name_on_the_package_index():
    """There, "metamer" is another project."""
    other = re.compile(
        r"\b(?:pip|pipx|uv|uvx|tool) (?:install |add |run )[^\n`]*\bmetamer(?!-colour)\b|\bmetamer\[[a-z]+\]"
    )
    name = "metamer"
    assert all(other.search(hint) for hint in (f"pip install {name}", f"uv tool install {name}", f"{name}[window]"))
    assert not other.search(f"pip install '{name}-colour[window]'")
    found = []
    for path in tracked("*.py", "*.md", "*.toml", "*.txt", "Makefile", ".ci/run"):
        found += [f"{path}: {hit[0]}" for hit in other.finditer((ROOT / path).read_text(encoding="utf-8"))]
    assert not found, found


@pytest.mark.parametrize("folder", ["lighting", "viewer", "calibration"])
def test_every_refusal_says_what_would_do(trees, folder):
    """An `InputError` that is raised says what was expected, or what to try."""
    mute = []
    for path in (path for path in trees if path.parts[0] == folder):
        for node in ast.walk(trees[path]):
            made = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "InputError"
            if made and not {keyword.arg for keyword in node.keywords} & {"expected", "hint"}:
                mute.append(f"{path}:{node.lineno}")
    assert not mute, mute


# import-linter, with the contracts of pyproject.toml: `make lint` holds the tree to them.


def _contract(kind):
    (found,) = (one for one in PROJECT["tool"]["importlinter"]["contracts"] if one["type"] == kind)
    return found


def test_every_package_with_code_is_under_the_import_contract():
    lint = PROJECT["tool"]["importlinter"]
    assert lint["root_package"] == "metamer"
    layers = {name.strip() for layer in lint["contracts"][0]["layers"] for name in layer.split("|")}
    # Catalogues and examples are folders of data, with an empty __init__; the examples' scripts are nobody's module.
    roots = {
        name
        for name, folder in FOLDERS.items()
        if name.count(".") == 1 and any(path.stem.isidentifier() for path in folder.rglob("[!_]*.py"))
    }
    assert layers == roots == set(_contract("acyclic_siblings")["ancestors"])


def test_the_import_contract_bites(tmp_path):
    """Upside down, it is broken."""
    lint = PROJECT["tool"]["importlinter"]
    contract = lint["contracts"][0]
    turned = "\n".join(f"    {layer.replace(' | ', ' : ')}" for layer in reversed(contract["layers"]))
    config = tmp_path / "upside_down.ini"
    config.write_text(
        f"[importlinter]\nroot_package = {lint['root_package']}\n\n"
        f"[importlinter:contract:1]\nname = upside down\ntype = layers\nlayers =\n{turned}\n"
    )
    command = [tool("lint-imports"), "--no-cache", "--no-logo", "--config", str(config)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=patient(300))
    assert done.returncode == 1 and "is not allowed to import" in done.stdout, done.stdout + done.stderr


def test_the_contract_against_circles_sees_imports_in_functions_and_for_types(tmp_path):
    (tmp_path / "round").mkdir()
    (tmp_path / "round" / "__init__.py").touch()
    (tmp_path / "round" / "a.py").write_text(
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from .b import B\n"
    )
    (tmp_path / "round" / "b.py").write_text("B = 1\ndef f():\n    from . import a\n")
    config = tmp_path / "circles.ini"
    kind = _contract("acyclic_siblings")["type"]
    config.write_text(
        f"[importlinter]\nroot_package = round\n\n"
        f"[importlinter:contract:1]\nname = no circles\ntype = {kind}\nancestors =\n    round\n"
    )
    command = [tool("lint-imports"), "--no-cache", "--no-logo", "--config", str(config)]
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=patient(300))
    assert done.returncode == 1 and "No cycles are allowed in round" in done.stdout, done.stdout + done.stderr


@pytest.mark.slow
def test_no_module_imports_from_the_folder_that_holds_it():
    """The circle that the contract does not see: a folder's `__init__` gives out what the modules in it hold."""
    wrong = []
    for path in tracked("*.py"):
        for node in imports_from(path):
            if not node.level:
                continue
            folder = (ROOT / path).parents[node.level - 1].joinpath(*(node.module or "").split("."))
            modules = {entry.stem for entry in folder.iterdir()} if folder in (ROOT / path).parents else set()
            if modules and not {name.name for name in node.names} <= modules:
                wrong.append(f"{path}:{node.lineno}")
    assert not wrong, wrong


def test_every_test_has_a_limit(request):
    limits = {item.nodeid: item.get_closest_marker("timeout") for item in request.session.items}
    assert all(limit is not None and 0 < limit.args[0] <= 300 for limit in limits.values()), limits


def test_each_rule_of_the_makefile_stands_once():
    """The last of two would win, with no more than a warning."""
    rules = re.findall(r"^([\w$()/.-]+):(?!=)", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert "test-all" in rules and len(rules) == len(set(rules)), rules


def test_second_tier_is_the_same_everywhere(request):
    """Markers of pyproject.toml, the expression of the Makefile, limits of the tests' conftest, and the docs."""
    declared = {line.partition(":")[0] for line in PROJECT["tool"]["pytest"]["ini_options"]["markers"]}
    declared -= {"slow_cases(*ids)"}
    (expression,) = re.findall(r"^FIRST_TIER := not \((.+)\)$", (ROOT / "Makefile").read_text(), re.MULTILINE)
    (plugin,) = (one for one in request.config.pluginmanager.get_plugins() if hasattr(one, "SECOND_TIER"))
    assert set(expression.split(" or ")) == declared == set(plugin.SECOND_TIER)
    table = re.findall(r"^\| `(\w+)` \|", (ROOT / "docs" / "testing.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert set(table) == declared


# Openings of sentences that hide the verb or the noun that a reader looks for.
HIDING = ("What", "Of", "Whether", "That", "Those", "Whoever", "So many", "From", "Where", "Which", "How")
OPENINGS = tuple(f"{word} " for word in HIDING)
# The same at the beginning of a comment of Python, GLSL or JavaScript; "From" may be a direction there.
COMMENT = re.compile(rf"^(?P<code>.*?)(?P<mark>#:?|//) (?P<hidden>{'|'.join(set(HIDING) - {'From'})})\b")


class Definition(NamedTuple):
    """Place of a module, a class or a function of the product, and its docstring; functions in functions are none."""

    path: Path
    line: int
    kind: type[ast.AST]
    # Names from the outermost class on; a module has none.
    names: tuple[str, ...]
    setter: bool
    doc: str

    @property
    def where(self):
        return f"{self.path}:{self.line} {'.'.join(self.names)}"


@pytest.fixture(scope="module")
def definitions(trees):
    found = []

    def look(path, node, names):
        setter = any(getattr(one, "attr", "") == "setter" for one in getattr(node, "decorator_list", ()))
        doc = ast.get_docstring(node) or ""
        found.append(Definition(path, getattr(node, "lineno", 1), type(node), names, setter, doc))
        for inner in () if isinstance(node, ast.FunctionDef) else node.body:
            if isinstance(inner, ast.FunctionDef | ast.ClassDef):
                look(path, inner, (*names, inner.name))

    for path, tree in trees.items():
        if path.parts[0] != "examples":
            look(path, tree, ())
    return found


def test_every_public_definition_says_what_it_is(definitions):
    """Overrides in subclasses too: what is true of the base may need a word of its own."""
    missing = [
        one.where
        for one in definitions
        if one.names and not one.doc and not one.setter and not any(name.startswith("_") for name in one.names)
    ]
    assert not missing, missing


def test_docstrings_begin_with_a_verb_or_a_noun(definitions):
    """Modules, classes and public functions of the product are held to it, functions of benchmarks are not."""
    held = [
        one
        for one in definitions
        if one.kind is not ast.FunctionDef or (not one.names[-1].startswith("_") and one.path.parts[0] != "benchmarks")
    ]
    assert held
    wrong = [f"{one.where}: {one.doc.splitlines()[0]}" for one in held if one.doc.startswith(OPENINGS)]
    assert not wrong, "\n".join(wrong)


def hidden_openings(text):
    """Yield the numbers and texts of lines with a comment that begins so; further lines of a comment are none."""
    before = ""
    for number, line in enumerate(text.splitlines(), 1):
        found = COMMENT.match(line)
        alone = found and not found["code"].strip()
        if found and (found["code"].endswith("  ") if not alone else not before.strip().startswith(("#", "//"))):
            yield number, line.strip()
        before = line


def test_comments_begin_with_a_verb_or_a_noun():
    wrong = [
        f"{path}:{number} {line}"
        for path in tracked("*.py", "*.glsl", "*.frag", "*.vert", "*.js")
        for number, line in hidden_openings((ROOT / path).read_text(encoding="utf-8"))
    ]
    assert not wrong, "\n".join(wrong)


def test_hidden_openings_are_those_of_comments():
    plain = "a = 1  # Whatever\n# One line\n# What goes on\nb = '# What'\n// Norm\n"
    assert not list(hidden_openings(plain))
    hiding = "#: What it is\nc = 2  # Of the light\n    // Where it lies\n"
    assert [number for number, _ in hidden_openings(hiding)] == [1, 2, 3]


def test_no_two_public_classes_have_one_name(definitions):
    places: dict[str, list[str]] = {}
    for one in definitions:
        if one.kind is ast.ClassDef and len(one.names) == 1 and not one.names[0].startswith("_"):
            places.setdefault(one.names[0], []).append(one.where)
    assert not {name: where for name, where in places.items() if len(where) > 1}


def test_no_module_gives_two_constants_one_name(trees):
    """The last of two would win, also where the first is meant."""
    twice = []
    for path, tree in trees.items():
        given = set()
        for node in tree.body:
            targets = getattr(node, "targets", None) or ([node.target] if isinstance(node, ast.AnnAssign) else [])
            parts = [part for target in targets for part in ast.walk(target)]
            for name in (part.id for part in parts if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)):
                twice += [f"{path}:{node.lineno} {name}"] if name in given else []
                given.add(name)
    assert not twice, twice


def _prose(page):
    """Markdown of a page or a notebook, without code."""
    text = page.read_text(encoding="utf-8")
    if page.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        text = "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    return re.sub(
        r"^```.*?^```|`[^`\n]*`", lambda code: code[0] if "\n" not in code[0] else "", text, flags=re.M | re.S
    )


def _anchors(page):
    """Names of headings as the site makes them, and those of the reference."""
    headings = re.findall(r"^#+ (.*?)\s*$", _prose(page), re.MULTILINE)
    words = (re.sub(r"[^\w\s-]", "", re.sub(r"\]\([^)]*\)", "", heading)).strip().lower() for heading in headings)
    return {re.sub(r"[-\s]+", "-", one) for one in words} | set(re.findall(r"^::: (\S+)", _prose(page), re.MULTILINE))


def test_links_of_the_documentation_lead_to_pages_and_headings_that_are_there():
    site, broken = ROOT / "docs", []
    for page in (*ROOT.glob("*.md"), *site.rglob("*.md"), *site.rglob("*.ipynb")):
        for text, target in re.findall(r"\[([^]]*)\]\(([^)\s]+)\)", _prose(page)):
            if re.match(r"[a-z]+:", target):
                continue
            file, _, anchor = target.partition("#")
            found = (page.parent / file).resolve() if file else page
            # The site has no file beside its own; the README is read where the tree is.
            inside = page.parent == ROOT or found.is_relative_to(site)
            known = (
                not anchor or found.suffix not in (".md", ".ipynb") or not found.is_file() or anchor in _anchors(found)
            )
            if not (found.exists() and inside and known):
                broken.append(f"{page.relative_to(ROOT)}: [{text}]({target})")
    assert not broken
