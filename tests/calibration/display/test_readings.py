"""Files of readings and what they leave open: each hard case is refused or told, never guessed."""

import numpy as np
import pytest
from metamer.calibration.display.characterise import characterise
from metamer.calibration.display.patch_files import write_patches
from metamer.calibration.display.patches import patches
from metamer.calibration.display.reading_files import Answers, read_readings
from metamer.calibration.display.readings import Readings
from metamer.runtime.errors import InputError
from metamer.spectral.formats.cgats_tables import read_tables

TI3 = """CTI3

DESCRIPTOR "Argyll Calibration Target chart information 3"
DEVICE_CLASS "DISPLAY"
COLOR_REP "RGB_XYZ"
TARGET_INSTRUMENT "a probe"
{keywords}
NUMBER_OF_FIELDS 7
BEGIN_DATA_FORMAT
SAMPLE_ID RGB_R RGB_G RGB_B XYZ_X XYZ_Y XYZ_Z
END_DATA_FORMAT

NUMBER_OF_SETS {count}
BEGIN_DATA
{rows}
END_DATA
"""


def ti3(tmp_path, readings, scale=100.0, xyz_scale=1.0, keywords=""):
    rows = [f"{at} {' '.join(f'{v:.6f}' for v in (*codes * scale, *xyz * xyz_scale))}"
            for at, (codes, xyz) in enumerate(zip(readings.codes, readings.xyz, strict=True), 1)]  # fmt: skip
    path = tmp_path / "readings.ti3"
    path.write_text(TI3.format(keywords=keywords, count=len(rows), rows="\n".join(rows)), encoding="utf-8")
    return path


def test_csv_and_ti3_say_the_same(lcd, written, tmp_path):
    for path in (written(lcd), ti3(tmp_path, lcd)):
        found = read_readings(path)
        assert np.abs(found.codes - lcd.codes).max() < 1e-5
        assert np.abs(found.xyz - lcd.xyz).max() < 2e-3
        assert found.absolute


def test_readings_in_cd_m2_and_in_y_100(lcd, tmp_path):
    white = lcd.white_xyz[1]
    words = f'NORMALIZED_TO_Y_100 "YES"\nLUMINANCE_XYZ_CDM2 "1 {white:.6f} 1"'
    found = read_readings(ti3(tmp_path, lcd, xyz_scale=100.0 / white, keywords=words))
    assert found.absolute and np.abs(found.xyz - lcd.xyz).max() < 1e-3
    relative = read_readings(ti3(tmp_path, lcd, xyz_scale=100.0 / white, keywords='NORMALIZED_TO_Y_100 "YES"'))
    assert not relative.absolute and relative.white_xyz[1] == pytest.approx(100.0, abs=0.01)


def test_white_of_100_in_a_table_is_asked_for(lcd, written):
    relative = Readings(lcd.codes, lcd.xyz * (100.0 / lcd.white_xyz[1]))
    path = written(relative, unit="")
    with pytest.raises(InputError, match="relative to white = 100"):
        read_readings(path)
    found = read_readings(path, Answers(unit="Y100", luminance=120.0))
    assert found.white_xyz[1] == pytest.approx(120.0, rel=1e-5)


def test_codes_of_255_where_100_is_full_scale_are_refused(lcd, tmp_path):
    path = ti3(tmp_path, lcd, scale=255.0)
    with pytest.raises(InputError, match="codes beyond their scale"):
        read_readings(path)
    assert read_readings(path, Answers(codes=255.0)).codes.max() == 1.0


def test_whole_codes_up_to_100_are_asked_for(lcd, written):
    """They may be percent, or the lower part of 255."""
    path = written(Readings(np.round(lcd.codes * 100.0) / 100.0, lcd.xyz), 100.0)
    with pytest.raises(InputError, match="scale of the codes is not told"):
        read_readings(path)
    assert read_readings(path, Answers(codes=100.0)).codes.max() == 1.0


def test_a_negative_reading(lcd):
    xyz = lcd.xyz.copy()
    xyz[5, 2] = -1.0
    with pytest.raises(InputError, match="a negative reading"):
        Readings(lcd.codes, xyz)
    xyz[5, 2] = -1e-3
    assert Readings(lcd.codes, xyz).xyz[5, 2] == -1e-3


def test_two_displays_in_one_file(lcd, tmp_path):
    path = tmp_path / "two.csv"
    path.write_text("display,r,g,b,X cd/m2,Y,Z\nleft,255,255,255,90,100,110\nright,255,255,255,80,90,99\n")
    with pytest.raises(InputError, match="several displays"):
        read_readings(path)


def test_files_of_other_kinds_are_refused_by_name(shared_data):
    with pytest.raises(InputError, match="no readings of patches"):
        read_readings(shared_data / "spectra" / "displays" / "WRGB_OLED_LG.ccss")


def test_cxf_with_rgb_and_xyz(tmp_path):
    seen = '<ColorValues><ColorCIEXYZ ColorSpecification="s"><X>{x}</X><Y>{y}</Y><Z>{z}</Z></ColorCIEXYZ></ColorValues>'
    sent = '<ColorRGB ColorSpecification="s"><R>{r}</R><G>{r}</G><B>{r}</B></ColorRGB>'
    one = f'<Object Id="o{{r}}" ObjectType="Target">{seen}<DeviceColorValues>{sent}</DeviceColorValues></Object>'
    objects = one.format(r=255, x=95, y=100.5, z=108) + one.format(r=0, x=0.1, y=0.1, z=0.1)
    path = tmp_path / "display.cxf"
    head = '<?xml version="1.0"?><CxF xmlns="http://colorexchangeformat.com/CxF3-core"><Resources><ObjectCollection>'
    path.write_text(f"{head}{objects}</ObjectCollection></Resources></CxF>", encoding="utf-8")
    found = read_readings(path)
    assert found.codes.tolist() == [[1, 1, 1], [0, 0, 0]] and found.xyz[0, 1] == 100.5


def test_shuffled_and_repeated_patches_are_the_same_display(lcd, lcd_choice, simulated):
    order = np.random.default_rng(3).permutation(len(lcd))
    again = np.concatenate([order, order[:20]])
    found = characterise(lcd.taken(again)).record
    codes = np.random.default_rng(4).random((200, 3))
    apart = np.abs(found.model.xyz(codes) - lcd_choice.model.xyz(codes))
    # Whites no longer stand between the others, so that drift, which is noise here, is taken out otherwise.
    assert apart.max() < 0.01 * lcd.white_xyz[1]
    assert len(found.readings) == len(lcd.averaged())


def test_missing_white_and_black_are_asked_for(lcd):
    for lacking, words in ((lcd.whites, "no reading of white"), (lcd.blacks, "no reading of black")):
        with pytest.raises(InputError, match=words):
            characterise(lcd.taken(np.setdiff1d(np.arange(len(lcd)), lacking)))


def test_a_stuck_channel(simulated, lcd):
    held = lcd.codes.copy()
    held[:, 2] = 0.0
    stuck = Readings(lcd.codes, simulated["LCD"].xyz(held))
    with pytest.raises(InputError, match="a channel is stuck") as refusal:
        characterise(stuck)
    assert refusal.value.field == "blue"


def test_patches_as_ti1_are_read_as_such(tmp_path):
    codes = patches(40)
    write_patches(tmp_path / "p.ti1", codes)
    (table,) = read_tables(tmp_path / "p.ti1")
    rows = np.array([[float(cell) for cell in row[1:4]] for row in table.rows])
    assert table.identifier == "CTI1" and np.abs(rows / 100.0 - codes).max() <= 0.5 / 255.0 + 1e-6


@pytest.mark.parametrize("purpose", ["characterise", "verify"])
@pytest.mark.parametrize("count", [9, 51, 125])
def test_so_many_different_patches_with_white_between(purpose, count):
    codes = patches(count, purpose)
    assert len(np.unique(np.round(codes, 6), axis=0)) == count
    whites = np.flatnonzero((codes >= 1.0).all(axis=1))
    assert whites[0] == 0 and whites[-1] == len(codes) - 1 and np.diff(whites).max() <= 16


def test_sets_to_verify_hold_other_colours():
    one, other = (np.unique(np.round(patches(125, purpose), 6), axis=0) for purpose in ("characterise", "verify"))
    shared = [row for row in other.tolist() if row in one.tolist()]
    assert len(shared) <= 8
