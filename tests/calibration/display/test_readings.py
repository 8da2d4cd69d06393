"""Files of readings and what they leave open: each hard case is refused or told, never guessed."""

import numpy as np
import pytest
from metamer.calibration.display.characterise import characterise
from metamer.calibration.display.patch_files import write_patches
from metamer.calibration.display.patches import patches
from metamer.calibration.display.reading_files import Answers, read_readings
from metamer.calibration.display.readings import Readings, ReadingSpectra
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


def cxf(tmp_path, white=130.5, specification="", range_of_codes=""):
    seen = '<ColorValues><ColorCIEXYZ ColorSpecification="s"><X>{x}</X><Y>{y}</Y><Z>{z}</Z></ColorCIEXYZ></ColorValues>'
    sent = f'<ColorRGB ColorSpecification="s">{range_of_codes}<R>{{r}}</R><G>{{r}}</G><B>{{r}}</B></ColorRGB>'
    one = f'<Object Id="o{{r}}" ObjectType="Target">{seen}<DeviceColorValues>{sent}</DeviceColorValues></Object>'
    objects = one.format(r=255, x=0.95 * white, y=white, z=1.08 * white) + one.format(r=0, x=0.1, y=0.1, z=0.1)
    path = tmp_path / "display.cxf"
    head = '<?xml version="1.0"?><CxF xmlns="http://colorexchangeformat.com/CxF3-core"><Resources><ObjectCollection>'
    told = f'<ColorSpecificationCollection><ColorSpecification Id="s">{specification}</ColorSpecification>'
    told = f"{told}</ColorSpecificationCollection>" if specification else ""
    path.write_text(f"{head}{objects}</ObjectCollection>{told}</Resources></CxF>", encoding="utf-8")
    return path


def test_cxf_with_rgb_and_xyz(tmp_path):
    found = read_readings(cxf(tmp_path))
    assert found.codes.tolist() == [[1, 1, 1], [0, 0, 0]] and found.xyz[0, 1] == 130.5
    assert found.observer == "1931_2"


def test_what_a_cxf_leaves_open_is_asked_and_what_it_says_holds(tmp_path):
    with pytest.raises(InputError, match="cd/m2 or relative"):
        read_readings(cxf(tmp_path, white=100.0))
    found = read_readings(cxf(tmp_path, white=100.0), Answers(unit="Y100", luminance=140.0))
    assert found.xyz[0].tolist() == pytest.approx([133.0, 140.0, 151.2])
    ten = cxf(tmp_path, specification="<TristimulusSpec><Observer>10_Degree</Observer></TristimulusSpec>")
    assert read_readings(ten).observer == "1964_10"
    with pytest.raises(InputError, match="the file says it itself"):
        read_readings(ten, Answers(observer="1931_2"))
    own = '<TristimulusSpec><Observer Name="mine">Custom_CMF</Observer></TristimulusSpec>'
    with pytest.raises(InputError, match="not known") as asked:
        read_readings(cxf(tmp_path, specification=own))
    assert asked.value.found == "mine"
    assert read_readings(tmp_path / "display.cxf", Answers(observer="2015_10")).observer == "2015_10"
    scaled = cxf(tmp_path, range_of_codes="<MaxRange>1023</MaxRange>")
    assert read_readings(scaled).codes.max() == pytest.approx(255 / 1023)
    with pytest.raises(InputError, match="1023"):
        read_readings(scaled, Answers(codes=255.0))


def test_prints_are_no_display(lcd, tmp_path):
    printed = ti3(tmp_path, lcd)
    printed.write_text(printed.read_text().replace('"DISPLAY"', '"OUTPUT"'))
    with pytest.raises(InputError, match="something else than a display"):
        read_readings(printed)
    told = "<MeasurementSpec><MeasurementType>Colorimetric_Reflectance</MeasurementType></MeasurementSpec>"
    with pytest.raises(InputError, match="something else than a display"):
        read_readings(cxf(tmp_path, specification=told))


@pytest.mark.parametrize("heads", ["x,y,Y,X,Y,Z", "x,y,z,X,Y,Z", "X (cd/m2),Y (cd/m2),Z (cd/m2),x,y,Y"])
def test_chromaticities_beside_xyz_are_not_taken_for_them(lcd, tmp_path, heads):
    sums = lcd.xyz.sum(axis=1, keepdims=True)
    xy_and = {"x,y,Y": np.c_[lcd.xyz[:, :2] / sums, lcd.xyz[:, 1]], "x,y,z": lcd.xyz / sums}
    first = heads.split(",X")[0]
    both = np.c_[xy_and[first], lcd.xyz] if first in xy_and else np.c_[lcd.xyz, xy_and["x,y,Y"]]
    path = tmp_path / "readings.csv"
    np.savetxt(path, np.c_[lcd.codes * 255.0, both], "%.7g", ",", header=f"r,g,b,{heads}", comments="")
    found = read_readings(path)
    np.testing.assert_allclose(found.xyz, lcd.xyz, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("heads", ["r,g,b,X (target),Y (target),Z (target),X (read),Y (read),Z (read)",
                                   "r,g,b,R,G,B,X,Y,Z", "r,g,b,X,Y,Z,X,Y,Z"])  # fmt: skip
def test_columns_of_one_name_are_asked_about(tmp_path, heads):
    rows = np.random.default_rng(2).random((12, heads.count(",") + 1)) * 200.0
    np.savetxt(tmp_path / "readings.csv", rows, "%.7g", ",", header=heads, comments="")
    with pytest.raises(InputError, match="several columns of one name"):
        read_readings(tmp_path / "readings.csv", Answers(codes=255.0))


NM = np.arange(380.0, 781.0, 10.0)


@pytest.fixture
def spectral(tmp_path):
    """Writes XYZ and spectra of one display: (observer of XYZ, factor of XYZ, of all, keywords) -> path, spectra."""
    codes = np.round(patches(30) * 255.0) / 255.0
    bands = [np.exp(-0.5 * ((NM - middle) / width) ** 2) for middle, width in ((610, 18), (535, 25), (455, 12))]
    radiance = codes**2.2 @ np.stack(bands) * 3e-3 + 1e-6

    def write(observer, xyz_factor=1.0, factor=1.0, keywords=""):
        spectra = ReadingSpectra(NM, radiance)
        xyz = spectra.xyz(observer) * xyz_factor * factor
        rows = np.c_[np.arange(len(codes)), 100.0 * codes, xyz, 1000.0 * factor * radiance]
        fields = ["SAMPLE_ID", "RGB_R", "RGB_G", "RGB_B", "XYZ_X", "XYZ_Y", "XYZ_Z", *(f"SPEC_{nm:.0f}" for nm in NM)]
        lines = "\n".join(" ".join(f"{value:.8g}" for value in row) for row in rows)
        text = f'CTI3\n\nDEVICE_CLASS "DISPLAY"\nCOLOR_REP "RGB_XYZ"\n{keywords}\nSPECTRAL_BANDS "{len(NM)}"\n'
        text += f'SPECTRAL_START_NM "380"\nSPECTRAL_END_NM "780"\nSPECTRAL_NORM "1.0"\nNUMBER_OF_FIELDS {len(fields)}\n'
        text += f"BEGIN_DATA_FORMAT\n{' '.join(fields)}\nEND_DATA_FORMAT\nNUMBER_OF_SETS {len(rows)}\n"
        path = tmp_path / "spectral.ti3"
        path.write_text(f"{text}BEGIN_DATA\n{lines}\nEND_DATA\n")
        return path, spectra

    return write


@pytest.mark.parametrize("stated", ["1931_2", "1964_10", "2015_2"])
def test_spectra_tell_whose_the_xyz_beside_them_are(spectral, stated):
    path, spectra = spectral(stated)
    found = read_readings(path)
    assert found.observer == stated
    np.testing.assert_allclose(found.xyz, spectra.xyz(stated), rtol=1e-6)
    for asked in ("1931_2", "1964_10", "2015_10"):
        found = read_readings(path, Answers(observer=asked))
        assert found.observer == asked
        np.testing.assert_allclose(found.xyz, spectra.xyz(asked), rtol=1e-6)


@pytest.mark.parametrize("whole", [True, False])
def test_spectra_are_on_the_scale_of_the_xyz_beside_them(spectral, whole):
    """A file may normalise its XYZ alone, or its spectra, too."""
    _, spectra = spectral("1931_2")
    luminance = float(spectra.xyz("1931_2")[0, 1])
    words = f'NORMALIZED_TO_Y_100 "YES"\nLUMINANCE_XYZ_CDM2 "1 {luminance:.6f} 1"'
    share = 100.0 / luminance
    path, _ = spectral("1931_2", *((1.0, share) if whole else (share, 1.0)), words)
    for asked in ("1931_2", "1964_10"):
        found = read_readings(path, Answers(observer=asked))
        np.testing.assert_allclose(found.xyz, spectra.xyz(asked), rtol=1e-5)
        np.testing.assert_allclose(found.spectra.xyz("2015_2"), spectra.xyz("2015_2"), rtol=1e-5)


def test_spectra_of_other_readings_are_refused(spectral):
    path, _ = spectral("1931_2")
    head, data = path.read_text().split("BEGIN_DATA\n")
    rows = [row.split() for row in data.splitlines()[:-1]]
    moved = [" ".join(row[:7] + other[7:]) for row, other in zip(rows, rows[1:] + rows[:1], strict=True)]
    path.write_text(f"{head}BEGIN_DATA\n" + "\n".join(moved) + "\nEND_DATA\n")
    with pytest.raises(InputError, match="not those of the spectra"):
        read_readings(path)


def test_a_luminance_tells_that_xyz_are_relative(lcd, tmp_path):
    """Files of before ArgyllCMS said so."""
    white = lcd.white_xyz[1]
    words = f'LUMINANCE_XYZ_CDM2 "1 {1.7 * white:.6f} 1"'
    found = read_readings(ti3(tmp_path, lcd, xyz_scale=100.0 / white, keywords=words))
    assert found.white_xyz[1] == pytest.approx(1.7 * white, rel=1e-4)
    assert read_readings(ti3(tmp_path, lcd, xyz_scale=1.7, keywords=words)).white_xyz[1] == pytest.approx(1.7 * white)
    with pytest.raises(InputError, match="cd/m2 or relative"):
        read_readings(ti3(tmp_path, lcd, xyz_scale=100.0 / white))


def test_answers_that_cannot_be_are_refused(lcd, written, tmp_path):
    absolute, relative = written(lcd), Readings(lcd.codes, lcd.xyz / lcd.white_xyz[1])
    with pytest.raises(InputError, match="beside XYZ that have one"):
        read_readings(absolute, Answers(luminance=120.0))
    with pytest.raises(InputError, match="not relative to white = 100"):
        read_readings(written(relative, unit=""), Answers(unit="Y100", luminance=120.0))
    stated = ti3(tmp_path, lcd, keywords='NORMALIZED_TO_Y_100 "NO"')
    with pytest.raises(InputError, match="the file says it itself"):
        read_readings(stated, Answers(unit="Y100", luminance=120.0))


@pytest.mark.parametrize("bits", [8, 10, 12, 16])
def test_a_table_of_patches_comes_back_on_its_scale(tmp_path, lcd, bits):
    codes = patches(40)
    write_patches(tmp_path / "p.csv", codes, bits)
    rows = (tmp_path / "p.csv").read_text().splitlines()
    rows[1:] = [rows[1] + ",X,Y,Z", *(f"{row},95,130,108" for row in rows[2:])]
    (tmp_path / "p.csv").write_text("\n".join(rows))
    assert np.abs(read_readings(tmp_path / "p.csv").codes - codes).max() <= 0.5 / (2**bits - 1) + 1e-9


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


@pytest.mark.parametrize("unit", ["fL", "mcd/m2", "units", "%"])
def test_a_unit_that_is_not_known_is_not_taken_for_cd_m2(lcd, written, unit):
    """A foot-lambert is 3.4 cd/m2; only relative to white does no unit matter."""
    relative = Readings(lcd.codes, lcd.xyz * 100.0 / lcd.white_xyz[1])
    path = written(relative, unit=f" [{unit}]")
    for answers in (Answers(), Answers(unit="cd/m2")):
        with pytest.raises(InputError, match="in a unit that is not known"):
            read_readings(path, answers)
    assert not read_readings(path, Answers(unit="Y100")).absolute


@pytest.mark.parametrize("unit", [" cd/m2", " (nits)", " [cd·m-2]", "_cd/m2", " [cd / m^2]"])
def test_cd_m2_is_known_however_it_is_written(lcd, written, unit):
    relative = Readings(lcd.codes, lcd.xyz * 100.0 / lcd.white_xyz[1])
    path = written(relative, unit=unit)
    assert read_readings(path).absolute
    with pytest.raises(InputError, match="the file says it itself"):
        read_readings(path, Answers(unit="Y100"))
