"""Fixtures that every test folder shares: the real data beside the project, and a GL context where there is one."""

import gc
import hashlib
import importlib.util
import os
import runpy
import shutil
import subprocess
import sys
import types
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import NamedTuple

import metamer
import numpy as np
import pytest
import pytest_timeout
import shape_checks
from hypothesis import HealthCheck, settings
from patience import patient
from shape_checks import check_shapes, next_test

# Shapes in signatures are checked while tests run, and only then: where they cross the public border, which is what
# `metamer` gives out and the types beneath it.
PUBLIC = {f"metamer.{home.rpartition('.')[0]}" for home in metamer._HOMES.values()}
PUBLIC |= {f"metamer.spectral.{name}" for name in ("basis", "difference", "folding", "image", "palette", "wavelengths")}
check_shapes(sorted(PUBLIC))

# The same cases in every run, and no limit on one of them: what a loaded machine does is no failure.
settings.register_profile("steady", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("steady")

ROOT = Path(__file__).resolve().parent.parent
# Markers of tests that `make test` leaves to `make test-all`; docs/testing.md has a sentence on each.
SECOND_TIER = ("browser", "mitsuba", "slow", "stress", "window")
LIMIT_S, SECOND_TIER_LIMIT_S = 60, 300
# Limit of filling a catalogue that is kept between runs: a minute of one core on a quiet machine.
LONGEST_IMPORT_S = 1500


# Modules and tests stay until the end: collecting garbage among them takes a tenth of the time, and finds none.
gc.disable()


@pytest.hookimpl(trylast=True)
def pytest_collection_finish():
    gc.freeze()
    gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Give every test its limit; the first to begin is the longest, which would keep one process busy at the end."""
    for item in items:
        names = set()
        for marker in item.iter_markers():
            names.add(marker.name)
            if marker.name == "slow_cases" and item.callspec.id in marker.args:
                item.add_marker(pytest.mark.slow)
                names.add("slow")
        if "timeout" not in names:
            item.add_marker(pytest.mark.timeout(LIMIT_S if names.isdisjoint(SECOND_TIER) else SECOND_TIER_LIMIT_S))
    items.sort(key=lambda item: item.path.name != "test_shipped_review.py")


@pytest.hookimpl(tryfirst=True)
def pytest_timeout_set_timer(item, settings):
    """Make a limit as much longer as there are processes for each core when the test begins."""
    return pytest_timeout.pytest_timeout_set_timer(item, settings._replace(timeout=patient(settings.timeout)))


@pytest.fixture(scope="session", autouse=True)
def cache_of_its_own(tmp_path_factory, request):
    """Set the caches of renderers apart, away from the user's; hashes of code, tables and compiled shaders stay."""
    folder = tmp_path_factory.mktemp("cache")
    if (cache := getattr(request.config, "cache", None)) is not None:
        made_by = hashlib.sha256((ROOT / "runtime" / "code_hash.py").read_bytes()).hexdigest()
        (folder / "metamer").mkdir()
        (folder / "metamer" / "code").symlink_to(cache.mkdir(f"code-{made_by[:16]}"), target_is_directory=True)
        (folder / "metamer" / "colour").symlink_to(cache.mkdir("colour"), target_is_directory=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        if cache is not None:
            # Mesa's, by its version and the shaders' text: software GL compiles for half the time of a small picture.
            patch.setenv("MESA_SHADER_CACHE_DIR", str(cache.mkdir("shaders")))
        yield


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of measured files that are not part of the project; tests that need them skip without it."""
    folder = Path(os.environ.get("METAMER_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no measured data at {folder}; set METAMER_DATA to the folder that holds brdf/, spectra/, meshes/")
    return folder


@pytest.fixture(scope="session")
def merl_table(shared_data):
    """Gives tables (90,90,180,3) of measured materials by name: what the folder's own script writes into files."""

    def table(name):
        script = runpy.run_path(str(shared_data / "brdf" / "merl-fits" / "write_binary.py"))
        with script["FITS"]:
            return script["table"](name)

    return table


@pytest.fixture
def room_for():
    """A context in which no file grows beyond so many bytes: what a full disk does, without one."""
    resource = pytest.importorskip("resource")

    @contextmanager
    def limited(size: int):
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)

    return limited


TINY = """
family = "tiny"
kind = "analytic"
notes = "made for tests"

[[material]]
name = "matt-red"
model = "lambert"
reflectance = { table = "babelcolor", column = "red" }

[[material]]
name = "rough-blue"
model = "oren_nayar"
reflectance = { table = "babelcolor", column = "blue" }
sigma = 0.35

[[material]]
name = "satin-green"
model = "ashikhmin_shirley"
diffuse = { table = "babelcolor", column = "green" }
specular = { constant = 0.04 }
exponent_u = 25.0
exponent_v = 25.0

[[material]]
name = "copper"
model = "cook_torrance"
diffuse = { constant = 0.0 }
eta = { table = "copper", column = "n" }
k = { table = "copper", column = "k" }
roughness = 0.4
specular_weight = 1.0
distribution = "beckmann"
masking = "smith"
"""


@contextmanager
def without_limit():
    """The test that is on has no limit while work is done for many, which has one of its own; it begins anew after."""
    hook = _running[0].ihook
    hook.pytest_timeout_cancel_timer(item=_running[0])
    yield
    settings = pytest_timeout._get_item_settings(_running[0])
    if not settings.func_only:
        hook.pytest_timeout_set_timer(item=_running[0], settings=settings)


# The test that is on.
_running: list[pytest.Item] = []


@pytest.fixture(scope="session")
def kept_catalogue(tmp_path_factory, request):
    """Fills catalogues by the command, once for all runs: (name, folder of sources, *words of the import) -> a copy.

    What is kept bears the hash of the sources, of the words, and of the code that reads and fits.
    """
    from metamer.materials.intake.code_version import readers_hash

    cache = getattr(request.config, "cache", None)

    def copied(name: str, sources: Path, *words: str) -> Path:
        digest = hashlib.sha256(f"{readers_hash()}{words}{sys.version}".encode())
        for file in sorted(file for file in sources.rglob("*") if file.is_file() and "__pycache__" not in file.parts):
            digest.update(f"|{file.relative_to(sources).as_posix()}|".encode() + file.read_bytes())
        folder = tmp_path_factory.mktemp(name)
        kept = None if cache is None else Path(cache.mkdir("catalogues")) / f"{name}-{digest.hexdigest()[:16]}"
        if kept is not None and kept.is_dir():
            return Path(shutil.copytree(kept, folder / "copy"))
        with without_limit(), nullcontext() if kept is None else one_at_a_time(kept.with_suffix(".lock")):
            if kept is not None and kept.is_dir():  # another process was faster
                return Path(shutil.copytree(kept, folder / "copy"))
            # In a process without the checks of this one.
            command = [sys.executable, "-m", "metamer.cli.main", "catalogue", "import", sources]
            command += ["--into", folder / "catalogue", *words]
            done = subprocess.run(command, capture_output=True, text=True, timeout=patient(LONGEST_IMPORT_S))
            assert done.returncode == 0, done.stdout + done.stderr
            if kept is not None:
                whole = shutil.copytree(folder / "catalogue", kept.with_suffix(".new"), dirs_exist_ok=True)
                Path(whole).rename(kept)
        return folder / "catalogue"

    return copied


@contextmanager
def one_at_a_time(path: Path):
    """Other processes that come to this file wait until this one is through, where files can be locked."""
    with path.open("w") as lock:
        with suppress(ImportError):
            import fcntl

            fcntl.flock(lock, fcntl.LOCK_EX)
        yield


@pytest.fixture(scope="session")
def tiny_catalogue(tmp_path_factory, kept_catalogue) -> Path:
    """Folder of a catalogue of four materials, imported by the command; to be read only."""
    sources = tmp_path_factory.mktemp("sources") / "source"
    shutil.copytree(ROOT / "catalogs" / "shipped", sources, ignore=shutil.ignore_patterns("[!s]*.toml"))
    (sources / "tiny.toml").write_text(TINY, encoding="utf-8")
    return kept_catalogue("tiny", sources, "--budget", "1", "--jobs", "1")


@pytest.fixture(scope="session")
def gl():
    """A headless moderngl context, or a skip that says what the machine lacks."""
    from metamer.viewer.gl.context import NoGL, create_context

    try:
        _contexts.append(create_context())
    except NoGL as reason:
        pytest.skip(str(reason))
    return _contexts[-1]


# The context of `gl`, once it was asked for.
_contexts: list = []


def _keep_current():
    """Make the context of `gl` current, since a test before may have made another one."""
    if _contexts:
        from metamer.viewer.gl.context import make_current

        make_current(_contexts[0])


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    _running[:] = [item]
    next_test()
    _keep_current()


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_teardown():
    _keep_current()


class BothPictures(NamedTuple):
    """A scene drawn by numpy and by OpenGL: XYZ of each, the coverage that both have, and ΔE94 between them."""

    mine: np.ndarray
    theirs: np.ndarray
    coverage: np.ndarray
    off: np.ndarray

    @property
    def relative(self):
        """How far OpenGL is off, as a share of what is there, where something is lit."""
        lit = self.mine[..., 1] > 1e-3
        return np.abs(self.theirs[lit] / self.mine[lit] - 1.0)


@pytest.fixture
def drawn_by_both(gl):
    """Draws by numpy and by OpenGL, which have to cover the same: (scene, surfaces, filtering) -> BothPictures."""
    from metamer.spectral.difference import delta_e_xyz
    from metamer.viewer.gl.backend import gl_session
    from metamer.viewer.software.backend import software_session

    def drawn(scene, surfaces, filtering="linear"):
        with gl_session(gl, filtering) as hardware, software_session(filtering) as software:
            (theirs, covered), (mine, coverage) = (one.render(scene, None, surfaces) for one in (hardware, software))
        np.testing.assert_array_equal(covered, coverage)
        mine, theirs = mine.astype(float), theirs.astype(float)
        return BothPictures(mine, theirs, coverage, delta_e_xyz(mine, theirs, scene.adopted_white()))

    return drawn


@pytest.fixture
def write_matt():
    """Writes a matt surface, which its one term stands for exactly: (folder, id, reflectance, changes) -> path."""
    from metamer.materials.core.axes import Axis
    from metamer.materials.core.protocol import sphere_protocol
    from metamer.materials.factored.pack import FactoredBrdf, FactorPack
    from metamer.materials.records.material import MaterialRecord, Provenance
    from metamer.materials.records.record import MARKER, write_record
    from metamer.spectral.palette import Palette
    from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM

    def write(folder, material_id, reflectance=0.5, shown=None, **changes):
        reflectance = np.broadcast_to(reflectance, WORKING_WAVELENGTHS_NM.shape).astype(float)
        axes = tuple(Axis(name, 2, end) for name, end in (("theta_h", 1.6), ("theta_d", 1.6), ("phi_d", 3.2)))
        factors = (np.full((2, 1), 1 / np.pi), np.ones((2, 1)), np.ones((2, 1)))
        pack = FactorPack("hd", axes, factors, Palette.of((reflectance if shown is None else shown)[None]))
        record = MaterialRecord(
            material_id,
            material_id.partition("/")[0],
            "lambert",
            {"wavelengths_nm": WORKING_WAVELENGTHS_NM, "reflectance": reflectance},
            Provenance("a test", "none", "analytic"),
            None,
        )
        sphere = sphere_protocol(32)
        error = sphere.compare(sphere.reference(record.brdf()), sphere.sample(FactoredBrdf((pack,))))
        packs, error = changes.pop("packs", (pack,)), changes.pop("error", error)
        fields = {**record.__dict__, "fast": FactoredBrdf(packs, error) if packs else None} | changes
        folder.mkdir(parents=True, exist_ok=True)
        (folder / MARKER).write_text("schema = 2\n")
        path = folder / f"{material_id}.h5"
        write_record(MaterialRecord(**fields), path)
        return path

    return write


@pytest.fixture
def write_spectrum(write_matt):
    """Writes a spectrum without a surface: (folder, id, model, values) -> path."""

    def write(folder, material_id, model="emission", values=(0.2, 0.5, 0.9)):
        original = {"wavelengths_nm": np.linspace(400.0, 700.0, len(values)), "values": np.array(values)}
        bare = {"model": model, "parameters": {}, "packs": (), "error": None, "original": original}
        return write_matt(folder, material_id, **bare)

    return write


@pytest.fixture(scope="session")
def scenes() -> types.ModuleType:
    """The module viewer/scenes.py: small scenes and hand-made packs."""
    path = Path(__file__).parent / "viewer" / "scenes.py"
    spec = importlib.util.spec_from_file_location("viewer_test_scenes", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def as_users_call(monkeypatch):
    """Calls as they are outside of tests, where nothing checks types before a function does."""
    if shape_checks.ALL_SHAPES:
        pytest.skip("all types are checked")
    monkeypatch.setattr(shape_checks, "CHECKED_CALLS", 0)
