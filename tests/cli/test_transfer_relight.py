"""`metamer transfer relight`: materials and light that change, over rays that are traced once."""

import numpy as np
import pytest
from metamer.lighting.camera import Camera
from metamer.lighting.transfer import kept
from metamer.spectral.formats.exr import read_exr
from metamer.viewer import bouncing
from metamer.viewer.turntable import orbited


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
    traced, calls = kept._traced, []
    monkeypatch.setattr(kept, "_traced", lambda *given: calls.append(given) or traced(*given))
    words = ["--kept", tmp_path / "rays"]
    assert relight("--material", "floor=room/dark", *words)[0] == 0
    assert len(calls) == len(list((tmp_path / "rays").iterdir())) == 1
    code, said, _, _ = relight("--material", "ball=room/dark", *words)
    assert code == 0 and len(calls) == 1
    assert "1 of 1 block of rays were there" in said


def test_geometry_that_changed_since_is_traced_again(relight, room, monkeypatch, tmp_path):
    traced, calls = kept._traced, []
    monkeypatch.setattr(kept, "_traced", lambda *given: calls.append(given) or traced(*given))
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
    monkeypatch.setattr(bouncing, "indirect_light", lambda *given: calls.append(given) or found(*given))
    code, _, err, _ = relight("--material", "floor=room/dark", "--turntable", 5)
    assert code == 0, err
    # Before, after, and the turn as a whole.
    assert len(calls) == 3
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
    views = orbited(Camera(position=(1.0, 2.0, 3.0), target=(1.0, 0.0, 0.0), up=(0.0, 2.0, 0.0)), 4)
    expected = [(1, 2, 3), (4, 2, 0), (1, 2, -3), (-2, 2, 0)]
    np.testing.assert_allclose([one.position for one in views], expected, atol=1e-12)
    assert all(np.allclose(one.target, (1.0, 0.0, 0.0)) for one in views)


def test_with_nothing_kept_it_is_traced_for_the_pictures(relight, monkeypatch, tmp_path):
    monkeypatch.setenv("METAMER_CACHE_GB", "0")
    code, said, _, found = relight("--material", "floor=room/dark", "--kept", tmp_path / "rays")
    assert code == 0 and "of rays were there" not in said
    assert found["bounces"]["after"] >= 1
    assert not (tmp_path / "rays").exists()


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ([], 64, "nothing is changed"),
        (["--material", "floor"], 64, "PART=ID"),
        (["--material", "ground=room/dark"], 4, "floor"),
        (["--material", "floor=room/drak"], 4, "room/dark"),
        (["--material", "floor=room/dark", "--material", "floor=room/white"], 64, "two materials"),
        (["--illuminant", "D66"], 4, "D66"),
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
    monkeypatch.setattr(kept, "_traced", lambda *_: pytest.fail("traced again"))
    assert metamer("render", *words, "-o", tmp_path / "second.exr")[0] == 0
    first, second = (read_exr(tmp_path / f"{name}.exr")[1]["Y"] for name in ("first", "second"))
    assert np.array_equal(first, second)
