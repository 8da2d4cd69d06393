"""Rays on disk: the same bytes whoever traces them and however often it is broken off; never believed blindly."""

import hashlib
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.mesh.shapes import plane, sphere
from metamer.lighting.transfer import hits, ray_cache
from metamer.lighting.transfer.edge_refinement import placed
from metamer.lighting.transfer.ray_cache import build_rays, kept_hits, ray_key
from metamer.lighting.visibility import cache_limits
from metamer.runtime.errors import NoRoomError
from patience import patient

RAYS = 16


@pytest.fixture(scope="module")
def scene(scene_of):
    """A ball above a floor, some 900 sites."""
    return scene_of(sphere(3, 0.4).placed(translate=(0.0, 0.5, 0.0)), plane(4, 4))


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    """32 sites a block: some 25 files."""
    monkeypatch.setattr(hits, "_AT_ONCE", 32 * RAYS)


def contents(folder):
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in folder.iterdir()}


def same(one, other):
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in ("triangle", "place", "areas"))


@pytest.fixture(scope="module")
def undisturbed(scene, tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(hits, "_AT_ONCE", 32 * RAYS)
        return build_rays(scene, folder, RAYS), contents(folder)


def test_what_is_read_is_what_is_traced(scene, tmp_path, monkeypatch):
    built = build_rays(scene, tmp_path / "made" / "here", RAYS)
    assert len(built.files) > 10 and built.there == 0
    assert built.nbytes == sum(file.stat().st_size for file in built.files)
    expected = placed(scene).traced(RAYS)
    monkeypatch.setattr(ray_cache, "_traced", lambda *_: pytest.fail("traced again"))
    found = kept_hits(scene, tmp_path / "made" / "here", RAYS)
    assert same(found, expected)
    assert found.sites.starts.shape == expected.sites.starts.shape
    assert build_rays(scene, tmp_path / "made" / "here", RAYS).there == len(built.files)


def test_the_bytes_do_not_hang_on_processes(scene, undisturbed, tmp_path):
    assert build_rays(scene, tmp_path, RAYS, jobs=3).nbytes == undisturbed[0].nbytes
    assert contents(tmp_path) == undisturbed[1]


def test_nor_do_rays_on_blocks(scene, tmp_path, monkeypatch):
    expected = placed(scene).traced(RAYS)
    for sites in (1000000, 7):
        monkeypatch.setattr(hits, "_AT_ONCE", sites * RAYS)
        assert same(kept_hits(scene, tmp_path / str(sites), RAYS), expected)


def test_the_key_is_that_of_the_geometry_alone(scene):
    def key(scene, rays=RAYS, longest=None):
        return ray_key(placed(scene, longest), rays)

    first = key(scene)
    assert key(scene.with_material("0", "another")) == first
    camera = replace(scene.camera(), position=np.array([9.0, 9.0, 9.0]))
    assert key(replace(scene, cameras=(camera,), lights=scene.lights * 2)) == first
    assert key(scene, RAYS + 1) != first
    assert key(scene, longest=0.5) != first
    mesh = scene.parts[0].mesh
    moved = mesh.vertices.copy()
    moved[5, 1] += 1e-5
    other = replace(scene.parts[0], mesh=replace(mesh, vertices=moved))
    assert key(replace(scene, parts=(other, scene.parts[1]))) != first


@pytest.mark.parametrize("damage", ["cut", "empty", "bit", "another block"])
def test_a_damaged_block_is_named_and_traced_anew(scene, undisturbed, tmp_path, damage):
    built = build_rays(scene, tmp_path, RAYS)
    file = built.files[3]
    data = bytearray(file.read_bytes())
    if damage == "bit":
        data[len(data) // 2] ^= 16
    elif damage == "another block":
        data = built.files[4].read_bytes()
    file.write_bytes({"cut": data[: len(data) // 2], "empty": b""}.get(damage, bytes(data)))
    said = []
    again = build_rays(scene, tmp_path, RAYS, say=said.append)
    assert again.there == len(built.files) - 1
    assert len(said) == 1 and file.name in said[0] and "damaged" in said[0]
    assert contents(tmp_path) == undisturbed[1]


@pytest.mark.slow
def test_a_build_that_is_broken_off_twenty_times_ends_in_the_same_bytes(scene, tmp_path):
    stopped, whole, broken_off = 0, tmp_path / "whole", tmp_path / "broken-off"
    # At the vertices alone: where sites are is worked out anew each time.
    build_rays(scene, whole, RAYS, longest_edge=9.0)

    def stop_after_one_more(done, total, what):
        if len(list(broken_off.iterdir())) > stopped:
            raise KeyboardInterrupt

    while stopped < 20:
        with pytest.raises(KeyboardInterrupt):
            build_rays(scene, broken_off, RAYS, progress=stop_after_one_more, longest_edge=9.0)
        stopped += 1
        found = contents(broken_off)
        assert len(found) == stopped and found.items() < contents(whole).items()
    build_rays(scene, broken_off, RAYS, longest_edge=9.0)
    assert contents(broken_off) == contents(whole)


BUILD = """
import sys
import numpy as np
from metamer.lighting.lights import DirectionalLight
from metamer.lighting.scene import Part, Scene, bounds_of, framing_camera
from metamer.lighting.mesh.shapes import sphere
from metamer.lighting.transfer import hits
from metamer.lighting.transfer.ray_cache import build_rays
from metamer.spectral.observers import observer
from metamer.spectral.spectrum import Spectrum

hits._AT_ONCE = 64 * 16
ball = sphere(5, 0.4)
light = DirectionalLight((0.0, 1.0, 0.0), Spectrum(np.ones(2), np.array([400.0, 700.0]), "emission"))
scene = Scene((Part("ball", ball, "matt"),), (light,), (framing_camera(*bounds_of([ball])),), observer("1931_2"))
print("begins", flush=True)
build_rays(scene, sys.argv[1], 16, jobs=int(sys.argv[2]))
"""


@pytest.mark.stress
def test_a_build_that_is_killed_goes_on_from_what_is_there(tmp_path):
    def command(folder, jobs):
        return [sys.executable, "-c", BUILD, str(folder), str(jobs)]

    whole, killed = tmp_path / "whole", tmp_path / "killed"
    subprocess.run(command(whole, 1), check=True, stdout=subprocess.DEVNULL)
    with subprocess.Popen(command(killed, 2), stdout=subprocess.PIPE) as process:
        deadline = time.monotonic() + patient(60.0)
        while not list(killed.glob("[!.]*.npz")) and time.monotonic() < deadline:
            time.sleep(0.002)
        process.send_signal(signal.SIGKILL)
    there = {name: held for name, held in contents(killed).items() if not name.startswith(".")}
    assert there and there.items() < contents(whole).items()
    subprocess.run(command(killed, 1), check=True, stdout=subprocess.DEVNULL)
    assert contents(killed) == contents(whole)


SMALL = BUILD.replace("sphere(5", "sphere(2").replace("64 * 16", "4 * 16")
KILLED = SMALL.replace(
    "build_rays(scene, sys.argv[1], 16, jobs=int(sys.argv[2]))",
    """
import os
import signal
from pathlib import Path

folder = Path(sys.argv[1])


def killed_after_one_more(done, total, what):
    if len(list(folder.glob("[!.]*.npz"))) > before:
        os.kill(os.getpid(), signal.SIGKILL)


folder.mkdir()
for _ in range(20):
    before = len(list(folder.glob("[!.]*.npz")))
    if not (child := os.fork()):
        build_rays(scene, folder, 16, progress=killed_after_one_more, longest_edge=9.0)
        os._exit(0)
    print(os.WTERMSIG(os.waitpid(child, 0)[1]), len(list(folder.glob("[!.]*.npz"))) - before, flush=True)
build_rays(scene, folder, 16, longest_edge=9.0)
build_rays(scene, sys.argv[2], 16, longest_edge=9.0)
""",
)


@pytest.mark.stress
def test_a_build_that_is_killed_twenty_times_ends_in_the_same_bytes(tmp_path):
    """By SIGKILL, each time after a further block; each time in a process of its own."""
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    words = [sys.executable, "-c", KILLED, str(killed), str(whole)]
    told = subprocess.run(words, check=True, capture_output=True, text=True).stdout.splitlines()
    assert told == ["begins", *["9 1"] * 20]
    assert contents(killed) == contents(whole)


def test_a_full_disk_leaves_only_whole_blocks(scene, undisturbed, tmp_path, room_for):
    with room_for(5_000), pytest.raises(NoRoomError):
        build_rays(scene, tmp_path, RAYS)
    assert contents(tmp_path).items() <= undisturbed[1].items()


def test_the_folder_is_held_to_its_limit_but_for_what_is_in_use(scene, scene_of, tmp_path, monkeypatch):
    first = build_rays(scene_of(sphere(2)), tmp_path, RAYS)
    for file in first.files:
        os.utime(file, (1000.0, 1000.0))
    monkeypatch.setenv(cache_limits.LIMIT_VARIABLE, "1e-9")
    expected = kept_hits(scene, tmp_path, RAYS)
    assert not any(file.exists() for file in first.files)
    assert same(kept_hits(scene, tmp_path, RAYS), expected)
    monkeypatch.setenv(cache_limits.LIMIT_VARIABLE, "0")
    assert same(kept_hits(scene, tmp_path / "never made", RAYS), expected)
    assert not (tmp_path / "never made").exists()


def test_a_material_that_changes_while_a_build_runs_changes_no_byte(scene, undisturbed, tmp_path):
    """Halfway through, somebody asks for the same parts in other materials, who builds the rest; both end alike."""
    parts = tuple(replace(part, material=f"other {part.name}") for part in scene.parts)
    other, found = replace(scene, parts=parts), []

    def changed(done, total, what):
        if done > total // 2 and not found:
            found.append(kept_hits(other, tmp_path, RAYS))

    build_rays(scene, tmp_path, RAYS, progress=changed)
    assert same(found[0], placed(scene).traced(RAYS))
    assert contents(tmp_path) == undisturbed[1]
