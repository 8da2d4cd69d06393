"""Cost of a picture, known before it is drawn: estimates hold what is measured, and what cannot fit is refused."""

import gc
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from metamer.lighting.environment.booth import light_booth
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.mesh import shapes
from metamer.lighting.mesh.cost import MeshCost, file_cost
from metamer.lighting.mesh.files import load_mesh
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.scene_file import files as scene_files
from metamer.lighting.scene_file.files import load_scene
from metamer.materials.analytic import AshikhminShirley
from metamer.materials.analytic.lambert import Lambert
from metamer.runtime import memory
from metamer.runtime.errors import InputError
from metamer.spectral.illuminants import illuminant
from metamer.spectral.image import ColourImage
from metamer.spectral.spectrum import WORKING_WAVELENGTHS_NM, Spectrum
from metamer.viewer.display.png import write_png
from metamer.viewer.picture import display_for
from metamer.viewer.render.picture_cost import picture_cost
from metamer.viewer.software.backend import software_session


def peak(work) -> int:
    """Bytes that Python and numpy hold at most at once while `work` is done."""
    gc.collect()
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def filled(scenes, lights: int, size: int, subdivisions: int = 3):
    """A ball that covers the whole picture, which is the most that it can cost."""
    scene = scenes.sphere_scene("matt", size=size, samples=2)
    ball = replace(scene.parts[0], mesh=shapes.sphere(subdivisions))
    return replace(
        scene,
        parts=(ball,),
        lights=(scenes.sun(), scenes.lamp())[:lights],
        cameras=(replace(scene.camera(), height=1.2),),
    )


def within(measured: int, estimated: int) -> None:
    assert measured <= estimated <= 4 * measured, (measured, estimated)


@pytest.mark.parametrize("lights", [1, 2])
def test_memory_of_a_picture_is_foretold(scenes, tmp_path, lights):
    scene = filled(scenes, lights, 200)

    def work():
        xyz, coverage = software_session().render(scene, None, scenes.SURFACES)
        image = ColourImage(xyz, "xyz", scene.adopted_white())
        rgb, _ = display_for(scene).encode(image, coverage, image.white_xyz)
        write_png(tmp_path / "a.png", rgb)

    software_session().render(filled(scenes, lights, 8), None, scenes.SURFACES)
    within(peak(work), picture_cost(scene, scene.camera()).memory_bytes)


def test_memory_of_many_triangles_is_foretold(scenes):
    scene = filled(scenes, 2, 8, subdivisions=5)
    within(
        peak(lambda: software_session().render(scene, None, scenes.SURFACES)),
        picture_cost(scene, scene.camera(), suffix=".exr").memory_bytes,
    )


@pytest.mark.slow
def test_memory_of_the_reference_and_of_spectra_is_foretold(scenes):
    grey = Lambert(Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(81, 0.5), "reflectance"))
    scene = filled(scenes, 1, 200)
    reference_images(filled(scenes, 1, 8), None, {"matt": grey})
    measured = peak(lambda: reference_images(scene, None, {"matt": grey}))
    within(measured, picture_cost(scene, scene.camera(), "reference").memory_bytes)
    measured = peak(lambda: software_session().render_spectra(scene, None, scenes.SURFACES, WORKING_WAVELENGTHS_NM))
    within(measured, picture_cost(scene, scene.camera(), "spectra", ".exr").memory_bytes)


@pytest.mark.slow
def test_memory_and_time_under_a_light_from_all_around_are_foretold(scenes):
    coat = AshikhminShirley(
        *(Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(81, v)) for v in (0.5, 0.04)), 60.0, 60.0
    )
    booth = light_booth("D65")
    scene = replace(filled(scenes, 1, 160), lights=(booth,))
    small = replace(filled(scenes, 1, 8), lights=(booth,))
    reference_images(small, None, {"matt": coat}, most_directions=4)
    measured = peak(lambda: reference_images(scene, None, {"matt": coat}, budget=20.0))
    within(measured, picture_cost(scene, scene.camera(), "reference").memory_bytes)
    measured = peak(lambda: software_session().render(scene, None, scenes.SURFACES))
    within(measured, picture_cost(scene, scene.camera()).memory_bytes)
    for kind in ("picture", "reference", "review"):
        assert picture_cost(scene, scene.camera(), kind).seconds > picture_cost(small, small.camera(), kind).seconds
    assert ", 1 light: " in picture_cost(scene, scene.camera()).words
    # A quarter of a hundred thousand pixels in a booth take minutes, which has to be said before.
    assert picture_cost(scene, replace(scene.camera(), width=512, height_px=512), "reference").seconds > 60


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".stl", ".glb"])
def test_cost_of_a_mesh_file_is_foretold(tmp_path, suffix):
    trimesh = pytest.importorskip("trimesh")
    ball = shapes.sphere(5)
    path = tmp_path / f"ball{suffix}"
    trimesh.Trimesh(ball.vertices, ball.faces, process=False).export(path)
    load_mesh(path)
    estimate = file_cost(path)
    assert 0.8 * len(ball.faces) <= estimate.triangles <= 2.5 * len(ball.faces)
    assert peak(lambda: load_mesh(path)) <= estimate.memory_bytes


def test_a_text_mesh_has_fewer_triangles_a_byte(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    ball = trimesh.creation.icosphere(3)
    for suffix, encoding in ((".ply", "ascii"), (".stl", "stl_ascii")):
        path = tmp_path / f"ball{suffix}"
        options = {"encoding": "ascii"} if suffix == ".ply" else {"file_type": encoding}
        ball.export(path, **options)
        assert 0.5 * len(ball.faces) <= file_cost(path).triangles <= 2.5 * len(ball.faces)


def test_what_hides_light_that_spreads_counts_by_the_vertex(scenes):
    scene = scenes.sphere_scene()
    light = EnvironmentLight(np.ones((1, 4, 8)), (scene.lights[0].spectrum,))
    one, other = (picture_cost(replace(scene, lights=(each,)), scene.camera()) for each in (scene.lights[0], light))
    assert other.memory_bytes - one.memory_bytes >= 600 * len(scene.parts[0].mesh.vertices)


def test_two_million_triangles_under_an_environment_are_planned_for(scenes):
    # A closed mesh of a million vertices on a floor took 4.00 GB at the peak, of which 0.3 GB were the libraries.
    light = EnvironmentLight(np.ones((1, 4, 8)), (illuminant("D65"),))
    few, many = (
        picture_cost(
            replace(scene, parts=(replace(scene.parts[0], mesh=shapes.sphere(level)),), lights=(light,)), scene.camera()
        ).memory_bytes
        for scene, level in ((scenes.sphere_scene(), 0), (scenes.sphere_scene(), 5))
    )
    assert 3.7e9 <= (many - few) * 2_000_000 / (20 * (4**5 - 1)) <= 5e9


def test_a_picture_that_cannot_fit_is_refused_in_numbers(scenes, monkeypatch):
    monkeypatch.setattr(memory, "available_bytes", lambda: 4_000_000_000)
    scene = scenes.sphere_scene()
    large = replace(scene.camera(), width=16000, height_px=16000)
    estimate = picture_cost(scene, large)
    with pytest.raises(InputError) as caught:
        estimate.check_room(scene, large)
    message = str(caught.value)
    assert "camera ortho" in message and "16,000 x 16,000 pixels of 3 x 3 samples" in message
    assert f"{estimate.memory_bytes / 1e9:.3g} GB of memory" in message and "at most 4 GB" in message
    picture_cost(scene, scene.camera()).check_room(scene, scene.camera())
    monkeypatch.setattr(memory, "available_bytes", lambda: None)
    estimate.check_room(scene, large)


def test_a_mesh_that_cannot_fit_is_refused_before_it_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(memory, "available_bytes", lambda: 1_000_000)
    (tmp_path / "large.stl").write_bytes(bytes(84 + 50 * 100_000))
    (tmp_path / "scene.toml").write_text('[[part]]\nmesh = "large.stl"\n')
    monkeypatch.setattr(scene_files, "load_mesh", lambda *_: pytest.fail("it was read"))
    with pytest.raises(InputError, match=r"(?s)does not fit into memory.*100,00\d triangles.*named in: .*part 1"):
        load_scene(tmp_path / "scene.toml")
    (tmp_path / "scene.toml").write_text('[[part]]\nshape = "sphere"\nsubdivisions = 9\n')
    with pytest.raises(InputError, match=r"5,242,880 triangles, 4.98 GB"):
        load_scene(tmp_path / "scene.toml")


def test_a_large_mesh_is_spoken_of_before_it_is_read_and_a_small_one_is_not(tmp_path, monkeypatch):
    heard = []
    path = tmp_path / "scene.toml"
    path.write_text('[[part]]\nname = "a"\nshape = "sphere"\nsubdivisions = 2\n[[part]]\nmesh = "tri.obj"\n')
    (tmp_path / "tri.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    load_scene(path, say=heard.append)
    assert heard == []
    monkeypatch.setattr(scene_files, "SAID_FROM_SECONDS", 0.0)
    monkeypatch.setattr(scene_files, "load_mesh", lambda *_: heard.append("read") or load_mesh(*_))
    load_scene(path, say=heard.append)
    assert heard[0].startswith("making sphere 'a': up to 320 triangles") and heard[1].startswith("reading tri.obj: ")
    assert heard[2] == "read"


def test_costs_grow_with_everything_that_costs(scenes):
    scene = scenes.sphere_scene()
    camera = scene.camera()
    small = picture_cost(scene, camera)
    for more in (
        picture_cost(scene, replace(camera, width=4000)),
        picture_cost(scene, replace(camera, samples=20)),
        picture_cost(replace(scene, lights=scene.lights * 2), camera),
        picture_cost(replace(scene, parts=(replace(scene.parts[0], mesh=shapes.sphere(5)),)), camera),
    ):
        assert more.memory_bytes > small.memory_bytes and more.seconds > small.seconds
    assert picture_cost(scene, camera, "reference").seconds > small.seconds
    assert (
        picture_cost(scene, camera, "review", jobs=4).memory_bytes > picture_cost(scene, camera, "review").memory_bytes
    )
    assert MeshCost(10**9).seconds > 1000


def test_progress_of_a_picture_goes_tile_by_tile(scenes, monkeypatch):
    monkeypatch.setattr("metamer.viewer.render.view.TILE_SAMPLES", 64)
    renderer, said = software_session(), []
    renderer.configure(on_progress=lambda *step: said.append(step))
    scene = scenes.sphere_scene("matt", size=40, samples=3)
    renderer.render(scene, None, scenes.SURFACES)
    assert said == [(number, 4, "drawing") for number in (0, 1, 2, 3, 4)]
    said.clear()
    renderer.render_spectra(scene, None, scenes.SURFACES, WORKING_WAVELENGTHS_NM)
    assert said[-1] == (16, 16, "drawing") and [step[0] for step in said] == sorted(step[0] for step in said)


def test_progress_of_the_reference_goes_band_by_band(scenes):
    grey = Lambert(Spectrum.sampled(WORKING_WAVELENGTHS_NM, np.full(81, 0.5), "reflectance"))
    said, scene = [], scenes.sphere_scene("matt", size=10, samples=1)
    reference_images(scene, None, {"matt": grey}, band_samples=40, progress=lambda *step: said.append(step))
    assert said == [
        (0, 10, "sorting 5,120 triangles for rays"),
        (4, 10, "tracing"),
        (8, 10, "tracing"),
        (10, 10, "tracing"),
    ]
