"""`metamer transfer relight`: materials and light that change, over rays that are traced once."""

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.transfer import ray_cache
from metamer.runtime.progress import TimeLeft
from metamer.spectral.formats.exr import read_exr
from metamer.viewer.render import indirect_cache as bouncing
from metamer.viewer.sheets.turntable import turntable_cameras


def test_a_floor_changes_a_ball_only_by_way_of_others(relight, tmp_path):
    code, said, err, found = relight("--material", "floor=room/dark")
    assert code == 0, err
    assert "directly and by way of other parts" in said
    floor, ball = found["parts"]
    assert (floor["before"], floor["after"], ball["after"]) == ("room/white", "room/dark", "room/white")
    assert ball["delta_e94"]["directly"]["max"] < 1e-6
    assert ball["delta_e94"]["by_others"]["mean"] == pytest.approx(ball["delta_e94"]["all"]["mean"], abs=1e-6)
    assert ball["delta_e94"]["all"]["mean"] > 1.0
    assert floor["delta_e94"]["directly"]["mean"] > 10.0
    images = [read_exr(tmp_path / "relit" / f"{name}.exr")[1]["Y"] for name in ("before", "after")]
    assert images[1].sum() < 0.7 * images[0].sum()
    assert {file.name for file in (tmp_path / "relit").iterdir()} == {
        f"{name}.{kind}" for name in ("before", "after") for kind in ("png", "exr")
    }


def test_the_second_time_nothing_is_traced(relight, monkeypatch, tmp_path):
    traced, calls = ray_cache._traced, []
    monkeypatch.setattr(ray_cache, "_traced", lambda *given: calls.append(given) or traced(*given))
    words = ["--kept", tmp_path / "rays"]
    assert relight("--material", "floor=room/dark", *words)[0] == 0
    assert len(calls) == len(list((tmp_path / "rays").iterdir())) == 1
    code, said, _, _ = relight("--material", "ball=room/dark", *words)
    assert code == 0 and len(calls) == 1
    assert "1 of 1 block of rays were there" in said


@pytest.mark.slow
def test_geometry_that_changed_since_is_traced_again(relight, room, monkeypatch, tmp_path):
    traced, calls = ray_cache._traced, []
    monkeypatch.setattr(ray_cache, "_traced", lambda *given: calls.append(given) or traced(*given))
    words = ["--material", "floor=room/dark", "--kept", tmp_path / "rays"]
    relight(*words)
    room.write_text(room.read_text(encoding="utf-8").replace("[0, -1.2, 0]", "[0, -1.4, 0]"), encoding="utf-8")
    code, said, _, _ = relight(*words)
    assert code == 0 and len(calls) == 2
    assert "0 of 1 block of rays were there" in said


def test_another_light_is_judged_by_an_eye_used_to_it(relight):
    """Greys stay greys: without adaptation they would be off by ΔE94 20 and more."""
    code, _, err, found = relight("--illuminant", "A", "--spectral")
    assert code == 0, err
    assert all(part["delta_e94"]["all"]["max"] < 0.1 for part in found["parts"])


def test_a_turntable_finds_the_light_between_surfaces_once(relight, monkeypatch, tmp_path):
    from PIL import Image

    found, calls = bouncing.indirect_light, []
    monkeypatch.setattr(bouncing, "indirect_light", lambda *given, **more: calls.append(given) or found(*given, **more))
    begun, begin = [], TimeLeft._begun
    monkeypatch.setattr(TimeLeft, "_begun", lambda left, kind: begun.append((left, kind)) or begin(left, kind))
    code, _, err, _ = relight("--material", "floor=room/dark", "--turntable", 5)
    assert code == 0, err
    # Before, and after, which the turn goes round.
    assert len(calls) == 2
    # One estimate expects all of it, in that order.
    left, stages = begun[0][0], [kind for _, kind in begun]
    bounced = ["bounces", "drawing"]
    assert stages == ["interreflection", "drawing", "drawing", "interreflection", *bounced, *bounced, "turning"]
    assert [item.kind for item in left._items.values()] == stages and all(one is left for one, _ in begun)
    assert all(item.expected > 0.0 for item in left._items.values())
    turned = sorted((tmp_path / "relit").glob("turn-*.png"))
    pictures = [np.asarray(Image.open(file)) for file in (tmp_path / "relit" / "after.png", *turned)]
    assert len(turned) == 5 and np.array_equal(pictures[0], pictures[1])
    assert not np.array_equal(pictures[1], pictures[2])
    with Image.open(tmp_path / "relit" / "turntable.webp") as moving:
        assert moving.n_frames == 5
        for number in range(5):
            moving.seek(number)
            assert np.array_equal(np.asarray(moving.convert("RGB")), pictures[number + 1][..., :3])


def test_a_turn_goes_around_the_target_anticlockwise():
    views = turntable_cameras(Camera(position=(1.0, 2.0, 3.0), target=(1.0, 0.0, 0.0), up=(0.0, 2.0, 0.0)), 4)
    expected = [(1, 2, 3), (4, 2, 0), (1, 2, -3), (-2, 2, 0)]
    np.testing.assert_allclose([one.position for one in views], expected, atol=1e-12)
    assert all(np.allclose(one.target, (1.0, 0.0, 0.0)) for one in views)


def test_with_nothing_kept_it_is_traced_for_the_pictures(relight, monkeypatch, tmp_path):
    monkeypatch.setenv("METAMER_CACHE_GB", "0")
    code, said, _, found = relight("--material", "floor=room/dark", "--kept", tmp_path / "rays")
    assert code == 0 and "of rays were there" not in said
    assert found["bounces"]["after"] >= 1
    assert not (tmp_path / "rays").exists()


def test_parts_by_pattern_and_a_name_before_it(relight):
    code, _, err, found = relight("--material", "*=room/dark", "--material", "ball=room/grey")
    assert code == 0, err
    assert [part["after"] for part in found["parts"]] == ["room/dark", "room/grey"]


def test_a_file_is_a_material_as_an_import_fits_it(relight, room_catalogue, tmp_path):
    """From its source and from a catalogue's folder: what the catalogue has under its id."""
    source = tmp_path / "paint.toml"
    source.write_text(
        'family = "mine"\nkind = "analytic"\n[[material]]\nname = "dark"\nmodel = "lambert"\n'
        "reflectance = { constant = 0.1 }\n"
    )
    _, _, _, by_id = relight("--material", "floor=room/dark")
    for file in (source, room_catalogue / "room" / "dark.h5"):
        code, said, err, found = relight("--material", f"floor={file}")
        assert code == 0, err
        floor = found["parts"][0]
        assert floor["after"] == str(file) and f"{file}: lambert, from its file" in said
        assert floor["delta_e94"]["all"]["mean"] == pytest.approx(
            by_id["parts"][0]["delta_e94"]["all"]["mean"], abs=0.01
        )


def test_a_file_of_several_materials_or_of_a_lamp_says_what_to_do(relight, room_catalogue, write_spectrum, tmp_path):
    code, _, err, _ = relight("--material", f"floor={room_catalogue.parent / 'room.toml'}")
    assert code == 4 and "4: white, dark" in err.replace("room/", "") and "catalogue import" in err
    write_spectrum(tmp_path / "lamps", "tiny/led")
    code, _, err, _ = relight("--material", f"floor={tmp_path / 'lamps' / 'tiny' / 'led.h5'}")
    assert code == 4 and "not a surface" in err


@pytest.mark.slow
def test_lights_change_one_by_one(relight, room, tmp_path):
    text = room.read_text(encoding="utf-8")
    more = '[[light]]\nname = "lamp"\nposition = [0, 3, 0]\nspectrum = "A"\nintensity_cd = 4000\n\n[[camera]]'
    room.write_text(text.replace("[[camera]]", more, 1), encoding="utf-8")
    _, said, _, louder = relight("--light", "lamp.intensity_cd=8000")
    assert "lamp: intensity_cd 8000" in said
    assert louder["parts"][0]["delta_e94"]["directly"]["mean"] > 2.0
    _, said, _, _ = relight("--illuminant", "D65", "--light", "lamp=FL11", "--light", "light 1.illuminance_lux=500")
    assert "lamp: lit by FL11" in said and "light 1: illuminance_lux 500" in said
    code, said, _, alone = relight("--light", "la*=off")
    assert code == 0 and "lamp: put out" in said
    assert alone["parts"][0]["delta_e94"]["all"]["mean"] > 2.0


@pytest.mark.slow
def test_any_number_of_rays_is_taken_and_kept(relight, tmp_path):
    rays = 19
    words = ["--material", "floor=room/dark", "--rays", rays, "--kept", tmp_path / "rays"]
    code, said, err, _ = relight(*words)
    assert code == 0, err
    assert f"vertices of {rays} rays, 0 of" in said
    assert f"{rays} rays each" in said
    assert "1 of 1 block of rays were there" in relight(*words)[1]


def test_a_static_part_keeps_its_material(relight, room):
    text = room.read_text(encoding="utf-8")
    room.write_text(text.replace('name = "floor"', 'name = "floor"\nstatic = true'), encoding="utf-8")
    for words in (
        ["--material", "floor=room/dark"],
        ["--material", "*=room/dark"],
        ["--set", "floor.reflectance_scale=0.5"],
        ["--like", "floor=darker:20"],
    ):
        code, _, err, _ = relight(*words)
        assert code == 4 and "a static part keeps its material" in err and "static = true" in err
    assert relight("--material", "ball=room/dark")[0] == 0


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ([], 64, "nothing is changed"),
        (["--material", "floor"], 64, "PART=MATERIAL"),
        (["--material", "wall*=room/dark"], 4, "floor"),
        (["--material", "f*=room/dark", "--material", "*r=room/white"], 64, "floor is given two"),
        (["--material", "floor=none.toml"], 4, "neither a file nor a material"),
        (["--light", "lamp=A"], 4, "light 1"),
        (["--light", "light 1"], 64, "LIGHT=LAMP"),
        (["--light", "light 1=D66"], 64, "D66"),
        (["--light", "light 1.intensity_cd=3"], 64, "illuminance_lux"),
        (["--light", "light 1.illuminance_lux=much"], 64, "not a number"),
        (["--light", "light 1.illuminance_lux=-1"], 64, "more than 0"),
        (["--light", "light 1=off"], 64, "no light is left"),
        (["--material", "floor=room/dark", "--rays", "0"], 64, "at least 1"),
        (["--material", "floor=room/dark", "--rays", "15"], 64, "16 or more"),
        (["--material", "ground=room/dark"], 4, "floor"),
        (["--material", "floor=room/drak"], 4, "room/dark"),
        (["--material", "floor=room/dark", "--material", "floor=room/white"], 64, "two materials"),
        (["--illuminant", "D66"], 64, "D66"),
        (["--illuminant", "A", "--camera", "side"], 4, "front"),
    ],
)
def test_what_is_refused(relight, words, code, said, tmp_path):
    found, _, err, _ = relight(*words)
    assert found == code
    assert said in err
    assert not (tmp_path / "relit").exists()


def test_an_empty_catalogue_is_said(metamer, room, tmp_path):
    empty = tmp_path / "empty"
    empty.mkdir()
    code, _, err = metamer("transfer", "relight", room, "--material", "floor=room/dark", "--catalogue", empty)
    assert code == 4 and "not a catalogue" in err and "catalogue import" in err


def test_pictures_of_one_geometry_trace_once_in_two_processes(metamer, room, room_catalogue, tmp_path, monkeypatch):
    """`metamer render` twice, as two commands do it: what the first has kept is all that the second needs."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    words = [room, "--catalogue", room_catalogue, "--renderer", "software", "--bounces", 1]
    assert metamer("render", *words, "-o", tmp_path / "first.exr")[0] == 0
    monkeypatch.setattr(ray_cache, "_traced", lambda *_: pytest.fail("traced again"))
    assert metamer("render", *words, "-o", tmp_path / "second.exr")[0] == 0
    first, second = (read_exr(tmp_path / f"{name}.exr")[1]["Y"] for name in ("first", "second"))
    assert np.array_equal(first, second)
