"""Code that counts for a fit: all that it can reach, nothing else, and the same everywhere."""

import ast
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from metamer.materials.analytic import MODELS
from metamer.materials.intake import code_version
from metamer.materials.intake.code_version import code_hash, imported_by, imports_in, modules_of
from metamer.materials.records.models import MEASURED, SPECTRA
from metamer.runtime import code_hash as code_hash_module
from metamer.runtime.errors import InputError

ROOT = Path(code_version.__file__).parents[2]
ALL = (*(model.NAME for model in MODELS), *MEASURED, *SPECTRA)


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    folder = tmp_path_factory.mktemp("copied")
    for name in ("runtime", "spectral", "materials", "cli", "calibration"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


@pytest.fixture(scope="module")
def before(copied):
    return {model: code_hash(model, copied) for model in ALL}


@pytest.fixture
def changed(copied, before):
    """Adds a constant to a module of the copy, for the length of a test: the models whose hash that changes."""
    texts = {}

    def change(module):
        file = copied / f"{module}.py"
        texts[file] = file.read_bytes()
        file.write_bytes(texts[file] + b"\n_ADDED = 1\n")
        forget()
        return {model for model in ALL if code_hash(model, copied) != before[model]}

    yield change
    for file, text in texts.items():
        file.write_bytes(text)
    forget()


def forget():
    for cached in (code_version._source, imported_by, modules_of, code_hash):
        cached.cache_clear()


SURFACES = {model.NAME for model in MODELS} | set(MEASURED)


@pytest.mark.parametrize(
    "module",
    [
        "spectral/difference",
        "spectral/observers",
        "spectral/wavelengths",
        "spectral/illuminants",
        "spectral/colour_library",
    ],
)
def test_what_colours_are_made_by_counts_for_every_material(changed, module):
    assert changed(module) == set(ALL)


@pytest.mark.parametrize("module", ["materials/fitting/cp", "materials/core/protocol", "materials/intake/work"])
def test_the_fit_counts_for_every_surface(changed, module):
    assert changed(module) == SURFACES


@pytest.mark.parametrize(
    ("module", "models"),
    [
        ("spectral/upsampling", {"btf", "maps", "merl", "rgl"}),
        ("materials/analytic/fluorescent", {"fluorescent_lambert"}),
        ("materials/measured/kriging", {"scattered"}),
        ("materials/measured/rgl_measurement", {"rgl"}),
        ("materials/analytic/oren_nayar", {"oren_nayar"}),
    ],
)
def test_what_one_model_needs_counts_for_that_one(changed, module, models):
    assert changed(module) == models


@pytest.mark.parametrize(
    "module",
    [
        "cli/catalogue/import_",
        "calibration/report/page",
        "materials/intake/importing",
        "materials/formats/registry",
        "materials/formats/merl",
    ],
)
def test_what_no_fit_reaches_refits_nothing(changed, module):
    assert changed(module) == set()


def test_another_release_of_a_library_counts(copied, monkeypatch):
    found = {"numpy": "2.1.3", "scipy": "1.14.1", "tensorly": "0.9.0", "colour-science": "0.4.6"}
    monkeypatch.setattr(code_hash_module, "version", lambda name: found[name])
    hashes = []
    for name, release in (("", ""), ("numpy", "2.1.4"), ("scipy", "1.15.0"), ("colour-science", "0.4.7")):
        found[name] = release
        code_hash.cache_clear()
        hashes.append(code_hash("lambert", copied))
    forget()
    # A release that mends faults of numpy changes no results.
    assert hashes[0] == hashes[1] and len(set(hashes)) == 3


@pytest.mark.slow
def test_every_library_that_a_fit_imports_is_known():
    known = {name for name, _ in code_version._LIBRARIES} - {"colour-science"} | {"colour"}
    # Checks of shapes, locks, memory and folders give no numbers; storage keeps every bit, here and elsewhere.
    plain = {"jaxtyping", "h5py", "filelock", "platformdirs", "psutil", "fsspec", "paramiko"}
    decoders = {"PIL", "OpenEXR"}
    found = set()
    # Theirs count where pictures are decoded.
    assert [model for model in ALL if code_version._PICTURES in modules_of(model)] == ["btf"]
    for module in {module for model in ALL for module in modules_of(model)}:
        for node in ast.walk(ast.parse((ROOT / f"{module}.py").read_bytes())):
            if isinstance(node, ast.ImportFrom) and not node.level:
                found.add(node.module.partition(".")[0])
            elif isinstance(node, ast.Import):
                found |= {name.name.partition(".")[0] for name in node.names}
    assert found - set(sys.stdlib_module_names) - plain - decoders <= known
    assert [name for name, _ in code_version._DECODERS] == ["pillow", "OpenEXR"]


@pytest.mark.slow_cases("scattered", "fluorescent_lambert")
@pytest.mark.parametrize("model", ["lambert", "scattered", "rgl", "fluorescent_lambert"])
def test_every_module_that_a_fit_loads_counts(model):
    """Looked at from the other side: what a fresh process holds once it has the fit and the model."""
    module = MEASURED[model].module if model in MEASURED else f"analytic.{model}"
    wanted = f"metamer.materials.fitting.fit, metamer.materials.records.record_colour, metamer.materials.{module}"
    modules = "n for n, m in sys.modules.items() if n.startswith('metamer.') and not hasattr(m, '__path__')"
    code = f"import sys, {wanted}; print(*({modules}))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    names = {name.removeprefix("metamer.").replace(".", "/") for name in loaded}
    # The package brings the other formulas along, and the type of a measurement its reader's own imports.
    files = ("runtime/files", "runtime/shutdown", "runtime/locks")
    formulas = ("materials/analytic/", "materials/core/domain")
    beside = (*formulas, "materials/formats/", "materials/intake/", "spectral/formats/", *files)
    readers = {name for name in names if name.startswith(beside)} if model != "scattered" else set()
    assert names - readers <= set(modules_of(model))


@pytest.mark.parametrize("package", ["spectral", "materials"])
def test_imports_are_what_the_parser_finds(package):
    for file in sorted((ROOT / package).rglob("*.py")):
        module = file.relative_to(ROOT).with_suffix("").as_posix()
        text = file.read_bytes()
        found = set(imports_in(module, text))
        for node in ast.walk(_without_types(ast.parse(text))):
            if isinstance(node, ast.ImportFrom) and node.level:
                folder = file.relative_to(ROOT).parents[node.level - 1]
                base = folder.joinpath(*(node.module or "").split(".")).as_posix()
                assert {base, *(f"{base}/{name.name}" for name in node.names)} <= found, (module, node.lineno)


def _without_types(tree):
    tree.body = [
        node for node in tree.body if not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    ]
    return tree


def test_the_order_of_imports_and_the_place_do_not_matter(copied, tmp_path):
    """In a fresh process, from an archive, after other modules: the same hash."""
    expected = code_hash("merl")
    assert code_hash("merl", copied) == expected
    with zipfile.ZipFile(tmp_path / "packed.zip", "w") as archive:
        archive.writestr("metamer/__init__.py", "")
        for file in copied.rglob("*.py"):
            archive.write(file, f"metamer/{file.relative_to(copied)}")
    code = "from metamer.materials.intake import code_version as it; print(it.__file__, it.code_hash('merl'))"
    fresh = "import sys; sys.meta_path[:] = [it for it in sys.meta_path if 'editable' not in repr(it)]; "
    for path, words in ((None, "import metamer.cli.main; "), (tmp_path / "packed.zip", fresh)):
        before = f"import sys; sys.path.insert(0, {str(path)!r}); " if path else ""
        done = subprocess.run(
            [sys.executable, "-c", before + words + code], capture_output=True, text=True, cwd=tmp_path
        )
        assert done.returncode == 0, done.stderr
        place, found = done.stdout.split()
        assert found == expected and ("packed.zip" in place) == bool(path)


def test_a_reworded_docstring_and_a_renamed_module_refit_nothing(copied, before):
    files = {file: file.read_bytes() for file in (copied / "materials/fitting").glob("*.py")}
    old, new = copied / "materials/fitting/refinement.py", copied / "materials/fitting/joint_least_squares.py"
    try:
        for file, text in files.items():
            first, quotes, rest = text.partition(b'"""')
            file.write_bytes(
                (first + quotes + b"Reworded: " + rest).replace(b"refinement import", b"joint_least_squares import")
            )
        old.rename(new)
        forget()
        assert {model: code_hash(model, copied) for model in ALL} == before
    finally:
        new.unlink(missing_ok=True)
        for file, text in files.items():
            file.write_bytes(text)
        forget()


def test_without_sources_there_is_no_hash(tmp_path):
    with pytest.raises(InputError, match="without its source"):
        code_hash("lambert", tmp_path)
