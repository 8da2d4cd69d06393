"""Pixels that the display is sent: OpenColorIO's own bytes, the sides as they are compared, proofs and warnings."""

from dataclasses import replace

import numpy as np
import pytest
from icc_profiles import matrix_profile, old_tables
from metamer.benchmarks.display.simulated import displays
from metamer.calibration.display.characterise import characterise
from metamer.calibration.display.cube import make_cube
from metamer.calibration.display.observer_aims import observer_aims
from metamer.calibration.display.patches import patches
from metamer.spectral.adaptation import adaptation_matrix
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.viewer.display.config import write_config
from metamer.viewer.display.proof import Proof
from metamer.viewer.display.transform import CLIP_TOLERANCE, DISPLAY_WHITE_XYZ, PINNED_CONFIG, DisplayTransform
from metamer.viewer.gl.resources import Owner
from metamer.viewer.window.chain import chain
from metamer.viewer.window.display_pass import STRIPE, Showing, display_of, needs_beyond, surround_xyz
from metamer.viewer.window.displayed_value import displayed
from metamer.viewer.window.queries import beyond
from metamer.viewer.window.state import Adaptation, Compare, DisplaySettings, Other, Session

ROWS, COLUMNS = 24, 40
STUDIO = "ocio://studio-config-v2.1.0_aces-v1.3_ocio-v2.3"
ACES_2 = "ocio://cg-config-v4.0.0_aces-v2.0_ocio-v2.5"
# Displays and views of three configurations; the first tells all.
VIEWS = (
    (PINNED_CONFIG, "sRGB - Display", "Un-tone-mapped"),
    (PINNED_CONFIG, "Display P3 - Display", "Un-tone-mapped"),
    (PINNED_CONFIG, "Rec.1886 Rec.709 - Display", "Un-tone-mapped"),
    (PINNED_CONFIG, "sRGB - Display", "ACES 1.0 - SDR Video"),
    (STUDIO, "sRGB - Display", "Un-tone-mapped"),
    (STUDIO, "P3-D65 - Display", "Un-tone-mapped"),
    (STUDIO, "Rec.1886 Rec.2020 - Display", "Un-tone-mapped"),
    (ACES_2, "sRGB - Display", "Un-tone-mapped"),
    (ACES_2, "Display P3 - Display", "Un-tone-mapped"),
    (ACES_2, "sRGB - Display", "ACES 2.0 - SDR 100 nits (Rec.709)"),
)
WHITES = tuple(observer("1931_2").white(illuminant(name)) for name in ("A", "D50"))


@pytest.fixture(scope="module")
def owner(gl):
    made = Owner(gl)
    yield made
    made.release()


@pytest.fixture(scope="module")
def showing(gl):
    made = Showing(gl)
    yield made
    made.release()


@pytest.fixture(scope="module")
def canvases(owner):
    """Colours in and out of any gamut, some brighter than white, some half covered."""
    rng = np.random.default_rng(5)
    found = []
    for white in WHITES:
        coverage = np.where(rng.random((ROWS, COLUMNS)) < 0.2, rng.random((ROWS, COLUMNS)), 1.0)
        xyz = white * rng.uniform(0.0, 1.25, (ROWS, COLUMNS, 1)) * rng.uniform(0.4, 1.2, (ROWS, COLUMNS, 3))
        found.append(np.dstack([xyz * coverage[..., None], coverage]).astype(np.float32))
    return found


@pytest.fixture(scope="module")
def textures(owner, canvases):
    return tuple(owner.texels(one) for one in canvases)


@pytest.fixture(scope="module")
def differences(owner):
    return owner.texture((COLUMNS, ROWS), 1, np.linspace(-1.0, 8.0, ROWS * COLUMNS, dtype=np.float32).tobytes())


def shown(showing, textures, differences, session, display=None):
    found = showing.draw(textures, differences, WHITES, session, display or DisplayTransform(config=PINNED_CONFIG))
    return np.frombuffer(found.read(), dtype=np.uint8).reshape(ROWS, COLUMNS, 4)[..., :3]


def in_numpy(canvas, white, session):
    """XYZ under the display's white, in double precision."""
    matrix = adaptation_matrix(white, DISPLAY_WHITE_XYZ, session.adaptation.method, session.adaptation.degree)
    xyz = 2.0**session.exposure * canvas[..., :3].astype(np.float64) @ matrix.T
    return xyz + (1.0 - canvas[..., 3:]) * surround_xyz(session.surround)


def codes(xyz_d65, display):
    return np.round(255.0 * np.clip(display.apply(xyz_d65), 0.0, 1.0)).astype(int)


@pytest.mark.parametrize("config, display, view", VIEWS)
def test_bytes_are_those_of_opencolorio_on_the_cpu(showing, textures, differences, canvases, config, display, view):
    import PyOpenColorIO as ocio

    if config.removeprefix("ocio://") not in [one[0] for one in ocio.BuiltinConfigRegistry().getBuiltinConfigs()]:
        pytest.skip(f"this OpenColorIO has no {config}")
    transform = DisplayTransform(display, view, config)
    session = Session(exposure=0.25, surround=40.0, adaptation=Adaptation(degree=0.8))
    found = shown(showing, textures, differences, session, transform).astype(int)
    off = np.abs(found - codes(in_numpy(canvases[0], WHITES[0], session), transform))
    # A GPU of NVIDIA rounds 2.5 % of the bytes of ten views otherwise, software GL fewer.
    assert off.max() <= 1 and (off > 0).mean() < 0.03


def test_every_way_to_compare_shows_the_side_that_it_says(showing, textures, differences):
    session = Session()
    sides = [
        shown(showing, textures, differences, replace(session, compare=Compare(mode))).copy() for mode in ("A", "B")
    ]
    rows, columns = np.mgrid[:ROWS, :COLUMNS]
    cell = max(1, round(0.25 * ROWS))
    whose = {
        "wipe": (columns + 0.5 >= 0.3 * COLUMNS, columns),
        "checkerboard": ((columns // cell + rows // cell) % 2 == 1, columns),
        "side by side": (columns >= COLUMNS // 2, columns % (COLUMNS // 2) + COLUMNS // 4),
    }
    for mode, (b, at) in whose.items():
        now = replace(session, compare=Compare(mode, position=0.3, cell=0.25))
        found = shown(showing, textures, differences, now)
        np.testing.assert_array_equal(found, np.where(b[..., None], sides[1][rows, at], sides[0][rows, at]))
        # A held flick shows the other side, whole.
        np.testing.assert_array_equal(shown(showing, textures, differences, replace(now, flicked=True)), sides[1])
    for mode, other in (("A", 1), ("B", 0)):
        now = replace(session, compare=Compare(mode), flicked=True)
        np.testing.assert_array_equal(shown(showing, textures, differences, now), sides[other])


def test_a_map_has_a_step_of_its_scale_at_each_pixel_and_none_where_nothing_is_compared(showing, textures, differences):
    from metamer.calibration.report import plots

    session = Session(compare=Compare("difference", scale=5.0, contour=False), surround=30.0)
    found = shown(showing, textures, differences, session).reshape(-1, 3).astype(int)
    values = np.linspace(-1.0, 8.0, ROWS * COLUMNS)
    table = np.concatenate([plots.scale_rgb(), [plots.OVER_RGB]])
    steps = len(table) - 1
    wanted = table[np.where(values > 5.0, steps, np.minimum((values / 5.0 * steps).astype(int), steps - 1))]
    numbers = values >= 0.0
    # A value on the edge of a step may fall to either side.
    assert (np.abs(found - wanted).max(axis=1)[numbers] > 1).mean() < 0.01
    assert len(np.unique(found[~numbers], axis=0)) == 1
    contoured = replace(session, compare=replace(session.compare, contour=True, tolerance=2.0))
    changed = (shown(showing, textures, differences, contoured).reshape(-1, 3) != found).any(axis=1)
    assert changed.any() and np.abs(values[changed] - 2.0).max() < 0.5


def test_a_proof_is_what_the_other_display_can_show(showing, textures, differences, canvases):
    display = DisplayTransform("Rec.1886 Rec.2020 - Display", "Un-tone-mapped", STUDIO)
    session = Session(shown=DisplaySettings(proof="sRGB - Display"))
    plain = codes(in_numpy(canvases[0], WHITES[0], session), display)
    found = shown(showing, textures, differences, session, display).astype(int)
    proof = Proof(DisplayTransform("sRGB - Display", "Un-tone-mapped", STUDIO))
    wanted = codes(proof.apply(in_numpy(canvases[0], WHITES[0], session)), display)
    assert np.abs(found - wanted).max() <= 1
    assert (np.abs(wanted - plain).max(axis=-1) > 3).mean() > 0.05
    held = proof.apply(np.array([0.4, 0.42, 0.45]))
    np.testing.assert_allclose(held, (0.4, 0.42, 0.45), atol=1e-5)


@pytest.mark.parametrize("made", [matrix_profile, old_tables])
def test_a_proof_of_a_profile_is_what_its_display_can_show(made, showing, textures, differences, canvases, tmp_path):
    (tmp_path / "other.icc").write_bytes(made(name="Other"))
    named = f"icc:{tmp_path / 'other.icc'}"
    display = DisplayTransform("Rec.1886 Rec.2020 - Display", "Un-tone-mapped", STUDIO)
    session = Session(shown=DisplaySettings(proof=named))
    found = shown(showing, textures, differences, session, display).astype(int)
    asked = in_numpy(canvases[0], WHITES[0], session)
    wanted = codes(Proof(DisplayTransform(named)).apply(asked), display)
    assert np.abs(found - wanted).max() <= 1
    assert (np.abs(wanted - codes(asked, display)).max(axis=-1) > 3).mean() > 0.05


@pytest.mark.parametrize("proof", [None, "sRGB - Display"])
def test_a_warning_marks_the_pixels_that_are_clipped_and_no_others(showing, textures, differences, canvases, proof):
    display = DisplayTransform("Rec.1886 Rec.2020 - Display", "Un-tone-mapped", STUDIO)
    session = Session(shown=DisplaySettings(proof=proof))
    plain = shown(showing, textures, differences, session, display).copy()
    found = shown(
        showing,
        textures,
        differences,
        replace(session, shown=DisplaySettings(gamut_warning=True, proof=proof)),
        display,
    )
    asked = display if proof is None else DisplayTransform(proof, "Un-tone-mapped", STUDIO)
    rgb = asked.apply(in_numpy(canvases[0], WHITES[0], session))
    rows, columns = np.mgrid[:ROWS, :COLUMNS]
    band = (rows + columns) // STRIPE % 4
    above = (rgb > 1.0 + CLIP_TOLERANCE).any(axis=-1) & (band == 0)
    below = (rgb < -CLIP_TOLERANCE).any(axis=-1) & (band == 2)
    assert above.any() and below.any() == (proof is not None)
    wanted = np.where(above[..., None], (255, 0, 0), np.where(below[..., None], (0, 0, 255), plain))
    np.testing.assert_array_equal(found, wanted)


def test_what_is_darker_than_black_is_marked_apart_from_what_is_out_of_gamut(showing, textures, differences, canvases):
    display = DisplayTransform("sRGB - Display", "Un-tone-mapped", STUDIO)
    xyz = in_numpy(canvases[0], WHITES[0], Session())
    below = (display.apply(xyz) < -CLIP_TOLERANCE).any(axis=-1)
    # Black of a display that sends this much light at code 0.
    vars(display)["black_y"] = float(np.median(xyz[below, 1]))
    plain = shown(showing, textures, differences, Session(), display).copy()
    found = shown(showing, textures, differences, Session(shown=DisplaySettings(gamut_warning=True)), display)
    rows, columns = np.mgrid[:ROWS, :COLUMNS]
    second = (rows + columns) // STRIPE % 4 == 2
    darker = below & second & display.darker_than_black(xyz)
    beyond_gamut = below & second & ~darker
    assert darker.any() and beyond_gamut.any()
    assert (found[darker] == (0, 255, 0)).all() and (found[beyond_gamut] == (0, 0, 255)).all()
    assert (found[second & ~below] == plain[second & ~below]).all()


def test_what_is_beyond_the_tables_of_a_profile_is_marked_once_it_is_known(
    showing, textures, differences, canvases, tmp_path
):
    """Its codes end at its gamut: they tell nothing."""
    (tmp_path / "desk.icc").write_bytes(old_tables(name="Desk"))
    display = DisplayTransform(f"icc:{tmp_path / 'desk.icc'}")
    plain = shown(showing, textures, differences, Session(), display).copy()
    warned = Session(shown=DisplaySettings(gamut_warning=True))
    assert needs_beyond(warned, display) and not needs_beyond(Session(), display)
    np.testing.assert_array_equal(shown(showing, textures, differences, warned, display), plain)
    xyz = in_numpy(canvases[0], WHITES[0], warned)
    compared = np.frombuffer(showing.compared.read(), dtype=np.float32).reshape(ROWS, COLUMNS, 4)[..., :3]
    np.testing.assert_allclose(compared, xyz, atol=1e-5)
    found = beyond(compared, display)
    assert {1, 2} <= set(found.ravel().tolist()) and (found == 0).any()
    marked = showing.draw(textures, differences, WHITES, warned, display, found)
    rows, columns = np.mgrid[:ROWS, :COLUMNS]
    band = (rows + columns) // STRIPE % 4
    above, below = (found == 2) & (band == 0), (found == 1) & (band == 2)
    wanted = np.where(above[..., None], (255, 0, 0), np.where(below[..., None], (0, 0, 255), plain))
    got = np.frombuffer(marked.read(), dtype=np.uint8).reshape(ROWS, COLUMNS, 4)[..., :3]
    np.testing.assert_array_equal(got, wanted)
    # Another picture is not marked by what was found of this one.
    np.testing.assert_array_equal(shown(showing, textures, differences, warned, display), plain)


def test_turned_round_transforms_undo_themselves(gl):
    display = DisplayTransform(config=PINNED_CONFIG)
    xyz = np.random.default_rng(0).uniform(0.1, 0.6, (50, 3)).astype(np.float32)
    np.testing.assert_allclose(display.decode(display.apply(xyz)), xyz, atol=2e-6)


def test_a_profile_takes_the_place_of_a_scene_s_display(tmp_path):
    """Its view and configuration are of the other one; a session that names nothing leaves the scene's."""
    (tmp_path / "desk.icc").write_bytes(matrix_profile(name="Desk"))
    own = f"icc:{tmp_path / 'desk.icc'}"
    toned = DisplayTransform("sRGB - Display", "ACES 1.0 - SDR Video", PINNED_CONFIG, "CAT16", "1931_2")
    found = display_of(Session(shown=DisplaySettings(display=own)), toned)
    assert (found.name, found.view, found.config) == ("ICC: Desk", "Un-tone-mapped", None)
    assert found.adaptation == "CAT16" and display_of(Session(), toned) == toned
    by_profile = DisplayTransform(own, observer="1931_2")
    assert display_of(Session(), by_profile) == by_profile
    other = display_of(
        Session(shown=DisplaySettings(display="Display P3 - Display", view="Un-tone-mapped")), by_profile
    )
    assert other.profile is None and other.name == "Display P3 - Display"


def test_a_profile_is_what_the_window_shows(showing, textures, differences, canvases, tmp_path):
    """To one code of OpenColorIO's bytes on the CPU, as any display; other than sRGB's."""
    (tmp_path / "desk.icc").write_bytes(old_tables(name="Desk"))
    display, session = DisplayTransform(f"icc:{tmp_path / 'desk.icc'}"), Session()
    found = shown(showing, textures, differences, session, display).astype(int)
    off = np.abs(found - codes(in_numpy(canvases[0], WHITES[0], session), display))
    assert off.max() <= 1 and (off > 0).mean() < 0.03
    assert np.abs(found - shown(showing, textures, differences, session).astype(int)).max() > 20


def test_the_display_is_aimed_for_the_observer_of_the_session(tmp_path):
    """Spectra tell how; without them the chain says that it still is for whom it was."""
    for spectra in (True, False):
        record = characterised(spectra)
        folder = tmp_path / str(spectra)
        write_config(
            folder, "Desk", record.model, make_cube(record.model, 17), record.aim, others=observer_aims(record)
        )
        session = Session(observer="1964_10", shown=DisplaySettings(config=str(folder / "config.ocio")))
        display = display_of(session, DisplayTransform())
        words = chain(session, display)
        assert display.name == ("Desk (1964_10)" if spectra else "Desk")
        assert (f"OCIO {display.name} / Un-tone-mapped" in words) and "colorimetric, no tone mapping" in words
        assert ("display still aimed for CIE 1931 2°" in words) != spectra
        # Its black has light: what is below it is no colour beyond its gamut.
        assert displayed(np.zeros(3), DISPLAY_WHITE_XYZ, display, Adaptation()).clipped == "darker than black"
        first = replace(session, observer="1931_2")
        display = display_of(first, DisplayTransform())
        assert display.name == "Desk" and not any("aimed" in one for one in chain(first, display))
        # One display shows both sides: it is aimed for A's.
        both = replace(first, other=Other(observer="1964_10"))
        assert "display aimed for CIE 1931 2°" in chain(both, display_of(both, DisplayTransform()))


def characterised(spectra):
    display, codes = displays()[0], patches(30)
    read = display.measured(codes, 0)
    return characterise(replace(read, spectra=display.spectra(codes)) if spectra else read, "Desk", "gog").record
