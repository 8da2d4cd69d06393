"""Signs of what was measured, never guessed: what each file is taken for, or refused with words that settle it."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.colour_library import colour_science
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.registry import read_spectra
from metamer.spectral.illuminants import illuminant, illuminant_names, light_source_names
from metamer.spectral.observers import observer

NM = np.arange(380.0, 781.0, 5.0)
GREY = 0.5 + 0.3 * np.sin(NM / 60.0)
ASKED = "what was measured?"


def table(*columns, head="", nm=NM):
    rows = zip(nm.tolist(), *(np.asarray(column).tolist() for column in columns), strict=True)
    return head + "".join(",".join(f"{cell:.7g}" for cell in row) + "\n" for row in rows)


def power(name):
    return illuminant(name).resampled(NM).samples


# Each: name of the file, content, what it is taken as ("" where it is refused), and words of that.
FILES = {
    "a heading": ("a.csv", table(GREY, head="nm,Reflectance\n"), "reflectance", "the heading 'Reflectance'"),
    "percent": ("a.csv", table(100 * GREY, head="nm,%R\n"), "reflectance", "in percent"),
    "a letter": ("a.csv", table(GREY, head="nm,R\n"), "reflectance", "in fractions"),
    "a fluorescent white": ("a.csv", table(1.2 * GREY, head="nm,reflectance factor\n"), "reflectance", "heading"),
    "glass of 10 mm": ("BK7.csv", table(90 + GREY, head="nm,Ti transmittance [%]\n"), "transmittance", "percent"),
    "a LED in W/nm": ("led.csv", table(1e-3 * GREY, head="nm,Flux [W/nm]\n"), "emission", "W/nm"),
    "relative power": ("x.csv", table(100 * GREY, head="nm,Relative intensity\n"), "emission", "intensity"),
    "a loss in dB": ("a.csv", table(20 * GREY, head="nm,Transmittance [dB]\n"), "", "function of a reflectance"),
    "what is not sent back": ("a.csv", table(GREY, head="# Reflectance\nnm,1-R\n"), "", "function of a reflectance"),
    "a BRDF": ("a.csv", table(GREY / 3, head="nm,Reflectance (1/sr)\n"), "", "function of a reflectance"),
    "a line of one": ("a.csv", table(GREY, head="# derivative of reflectance\nnm,value\n"), "", ASKED),
    "nothing at all": ("a.csv", table(GREY), "", ASKED),
    "names of samples": ("a.csv", table(GREY, GREY, head="nm,red,blue\n"), "", ASKED),
    "0.3 to 0.8 of something": ("a.csv", table(0.3 + 0.2 * GREY, head="nm,A\n"), "", "--scale"),
    "radiance without a word": ("a.csv", table(1e-6 * GREY, head="nm,A\n"), "", ASKED),
    "percent of something": ("a.csv", table(100 * GREY, head="nm,%\n"), "", ASKED),
    "an unnamed text": ("a.spd", table(GREY).replace(",", " "), "", "the suffix .spd"),
    "glass in a .spd": ("window.spd", table(GREY).replace(",", " "), "", "the suffix .spd"),
    "a lamp by file and suffix": ("lamp.spd", table(GREY).replace(",", " "), "", ASKED),
    "a lamp by name and numbers": ("lamp.spd", table(900 * GREY).replace(",", " "), "emission", "above any percentage"),
    "lines of mercury": ("a.csv", table(power("FL2") / 30.0), "emission", "FL2 and lines of mercury"),
    "a light by name and numbers": ("a.csv", table(power("LED-B1") / 7.0, head="nm,LED-B1\n"), "emission", "LED-B1"),
    "a name that the numbers belie": ("a.csv", table(GREY, head="nm,D65\n"), "", ASKED),
    "a word that the numbers belie": ("a.csv", table(power("FL2"), head="nm,R (%)\n"), "", "numbers another"),
    "F1 to F3": ("a.csv", table(*(power(f"FL{n}") for n in (1, 2, 3)), head="nm,F1,F2,F3\n"), "emission", "published"),
    "L41 in percent": ("a.csv", table(100 * GREY, head="nm,L41\n"), "", ASKED),
    "percent of fractions": ("a.csv", table(0.01 + GREY - GREY.min(), head="nm,R (%)\n"), "", "states percent"),
    "camera": ("a.csv", table(GREY, GREY, GREY, GREY, head="nm,R,Gr,Gb,B\n"), "", "channels of a camera"),
    "responsivity": ("a.csv", table(GREY, head="nm,Responsivity (A/W)\n"), "", "a sensitivity"),
    "density": ("a.csv", table(GREY, head="nm,optical density\n"), "", "absorbance"),
    "n and k": ("a.csv", table(GREY, GREY, head="nm,n,k\n"), "", "refractive index"),
    "counts": ("a.csv", table(4000 * GREY, head="nm,Counts\n"), "", "raw counts"),
    "photons": ("a.csv", table(GREY, head="nm,µmol/m2/s/nm\n"), "", "photons are not power"),
    "a lamp off a white": ("a.csv", table(GREY, head="# irradiance on a reflectance standard\nnm,A\n"), "", ASKED),
    "a light off a chart": ("a.csv", table(GREY, head="# spectral power off a chart\nnm,A\n"), "emission", "the line"),
    "shares of ink": ("a.csv", table(GREY, head="# reflectance\nnm,K 50%\n"), "reflectance", "in fractions"),
    "Radiant Orchid": ("a.csv", table(GREY, head="nm,Radiant Orchid\n"), "", ASKED),
}  # fmt: skip


@pytest.mark.parametrize("kind", FILES)
def test_each_kind_of_file_is_taken_for_what_it_says_or_refused(written, kind):
    name, content, quantity, words = FILES[kind]
    path = written(content, name)
    if not quantity:
        with pytest.raises(InputError) as caught:
            read_spectra(path)
        assert words in str(caught.value)
        assert words != ASKED or "--as reflectance, transmittance, emission or radiance-factor" in str(caught.value)
        return
    for entry in read_spectra(path).entries:
        assert entry.spectrum.quantity in (quantity, "radiance factor") and words in entry.taken


@pytest.mark.slow_cases("100.0", "1e-06")
@pytest.mark.parametrize("scale", [1.0, 100.0, 1e-6, "peak"])
def test_no_light_of_the_cie_is_ever_a_paint(written, scale):
    """Tables without a word, one a light: taken as emission where the numbers tell, else refused."""
    taken = 0
    for name in (*illuminant_names(), *light_source_names()):
        light = illuminant(name)
        factor = 1.0 / light.samples.max() if scale == "peak" else scale
        path = written(table(factor * light.samples, nm=light.wavelengths_nm), "sample_1.csv")
        try:
            assert {entry.spectrum.quantity for entry in read_spectra(path).entries} == {"emission"}, name
        except InputError as refusal:
            assert ASKED in str(refusal)
        else:
            taken += 1
    assert taken >= (65 if scale == "peak" else 114)


@pytest.mark.parametrize("scale", [1.0, 100.0, 1e-6])
def test_observers_and_cameras_are_known_by_their_numbers(written, scale):
    colour = colour_science()
    tables = [*colour.MSDS_CMFS.values(), *colour.MSDS_CAMERA_SENSITIVITIES.values()]
    for sensor in tables:
        path = written(table(*(scale * sensor.values.T), head="nm,a,b,c\n", nm=sensor.wavelengths), "sample_1.csv")
        with pytest.raises(InputError, match="a sensitivity is not the spectrum of a colour"):
            read_spectra(path, ImportOptions("reflectance", "fraction"))


@pytest.mark.parametrize(("factor", "scale"), [(1.0, "fractions"), (100.0, "percent")])
def test_a_known_chart_is_known_without_a_word(written, factor, scale):
    patches = colour_science().SDS_COLOURCHECKERS["ColorChecker N Ohta"]
    nm = next(iter(patches.values())).wavelengths
    path = written(table(*(factor * patch.values for patch in patches.values()), nm=nm), "sample_1.csv")
    entries = read_spectra(path).entries
    assert len(entries) == 24 and all(f"reflectance in {scale}" in entry.taken for entry in entries)
    np.testing.assert_allclose(entries[0].spectrum.samples, next(iter(patches.values())).values, rtol=1e-6)


@pytest.mark.parametrize("quantity", ["reflectance", "transmittance", "emission", "radiance factor"])
def test_an_answer_settles_what_a_file_leaves_open(written, quantity):
    scale = None if quantity == "emission" else "fraction"
    (entry,) = read_spectra(written(table(GREY), "a.csv"), ImportOptions(quantity, scale)).entries
    assert entry.spectrum.quantity == quantity and "--as" in entry.taken


def test_an_answer_does_not_overrule_what_a_file_says(written):
    lamp = written(table(GREY, head="nm,irradiance\n"), "a.csv")
    with pytest.raises(InputError, match="--as another") as caught:
        read_spectra(lamp, ImportOptions("reflectance", "fraction"))
    assert "emission, by the heading 'irradiance'; --as reflectance" in str(caught.value)
    with pytest.raises(InputError, match="--scale another"):
        read_spectra(written(table(100 * GREY, head="nm,%R\n"), "b.csv"), ImportOptions(None, "fraction"))


def test_a_lamp_among_many_reflectances_is_no_paint_though_it_is_called_one(written):
    with pytest.raises(InputError, match="the numbers another"):
        read_spectra(written(table(power("FL11")), "a.csv"), ImportOptions("reflectance", "percent"))


def test_an_answer_that_the_numbers_belie_is_refused(written):
    with pytest.raises(InputError, match="another scale than --scale says"):
        read_spectra(written(table(0.01 + GREY - GREY.min()), "a.csv"), ImportOptions("reflectance", "percent"))
    with pytest.raises(InputError, match="another scale than --scale says"):
        read_spectra(written(table(100 * GREY), "a.csv"), ImportOptions("reflectance", "fraction"))
    with pytest.raises(InputError, match="on no scale"):
        ImportOptions("emission", "percent")


def with_lightness(spectra, lightness, light):
    """A table across, with CIELAB and its illuminant beside, which says nothing else of what was measured."""
    rows = [
        [f"s{number}", light, f"{star:.2f}", "4", "-7", *(f"{value:.5f}" for value in row)]
        for number, (star, row) in enumerate(zip(lightness, spectra, strict=True))
    ]
    header = ["Name", "Illuminant", "L*", "a*", "b*", *(f"{nm:g}" for nm in NM)]
    return "".join(",".join(cells) + "\n" for cells in (header, *rows))


@pytest.mark.parametrize("light", ["D50", "D65"])
@pytest.mark.parametrize("scale", [1.0, 100.0])
def test_lab_beside_is_a_hint_where_it_is_that_of_the_spectra(written, scale, light):
    edges = ((480, 9), (560, -12), (610, 8))
    paints = np.array([0.01 + 0.8 / (1.0 + np.exp((edge - NM) / width)) for edge, width in edges])
    luminance = paints @ observer("1931_2").weights(illuminant(light), NM)[1]
    lightness = 116.0 * np.cbrt(luminance) - 16.0
    entries = read_spectra(written(with_lightness(scale * paints, lightness, light), "a.csv")).entries
    assert {entry.spectrum.quantity for entry in entries} == {"reflectance"}
    np.testing.assert_allclose(entries[1].spectrum.samples, paints[1], atol=1e-5)


@pytest.mark.parametrize("scale", [1.0, 0.02, 100.0])
def test_lab_of_a_display_does_not_make_a_surface_of_it(written, scale):
    """It is relative to the display's own white; its spectra are relative to their highest peak."""
    blue, green, red = (np.exp(-0.5 * ((NM - peak) / width) ** 2) for peak, width in ((450, 12), (540, 30), (610, 20)))
    shown = 0.004 + np.array([blue + 0.6 * green + 0.7 * red, 0.7 * red, blue])
    with pytest.raises(InputError, match="what was measured"):
        read_spectra(written(with_lightness(scale * shown, (100.0, 53.0, 32.0), "D50"), "a.csv"))


NAMES_OF_LIGHTS = ["D65", "d50", "illuminant", "Illuminant D65", "CIE A illuminant", "Light source", "lamp 2", "TL84"]
NAMES_OF_LIGHTS += ["CWF", "FL11", "F11 lamp", "LED-B1", "standard illuminant A", "Illum.", "ID65", "U30"]
NAMES_OF_LIGHTS += [
    "D65 (norm.)",
    "S(D65)",
    "S_D65",
    "D65_rel",
    "D65 normalised",
    "Lichtart A",
    "A spectrum",
]
RED = (0.062 + 0.57 / (1.0 + np.exp(-(np.arange(400, 701, 20) - 583.0) / 13.0))).round(4)
BLUE = (0.4 - 0.3 * RED).round(4)


def sheet(way, unit, *columns):
    """A sheet of reflectances, wavelengths down or across, of columns with a name and values."""
    nm = range(400, 701, 20)
    if way == "down":
        rows = [",".join(["nm", *(name for name, _ in columns)])]
        rows += [",".join(map(str, row)) for row in zip(nm, *(values for _, values in columns), strict=True)]
    else:
        rows = [",".join(["name", *map(str, nm)]), *(",".join([name, *map(str, values)]) for name, values in columns)]
    return "\n".join([f"Reflectance{unit}", *rows, ""])


@pytest.mark.parametrize("way", ["down", "across"])
@pytest.mark.parametrize("name", NAMES_OF_LIGHTS)
def test_what_is_called_as_a_light_among_samples_is_asked_about(written, name, way):
    lamp = (0.1 + 0.8 * np.exp(-(((np.arange(400, 701, 20) - 460.0) / 40.0) ** 2))).round(4)
    for unit, scale, of_light in (("", 1.0, 1.0), ("", 1.0, 80.0), (" (%)", 100.0, 1.0), (" (%)", 100.0, 90.0)):
        columns = (("red", RED * scale), (name, lamp * of_light), ("blue", BLUE * scale))
        file = read_spectra(written(sheet(way, unit, *columns)))
        assert [entry.name for entry in file.entries] == ["red", "blue"]
        np.testing.assert_allclose(file.entries[0].spectrum.samples, RED, rtol=1e-9)
        ((rejected, reason),) = file.rejected
        assert name.startswith(rejected) and reason.problem == "a sample, or a light?"


@pytest.mark.parametrize("way", ["down", "across"])
@pytest.mark.parametrize("name", ["A", "F11", "E", "light", "horizon", "cool white 2", "tungsten"])
def test_a_name_of_samples_and_lights_counts_where_the_numbers_are_a_lights(written, name, way):
    nm = np.arange(400, 701, 20)
    light = illuminant("A")
    power = np.interp(nm, light.wavelengths_nm, light.samples)
    beside = ("red", RED), ("blue", BLUE)
    file = read_spectra(written(sheet(way, "", *beside, (name, power / power.max()))))
    assert [entry.name for entry in file.entries] == ["red", "blue"] and [one for one, _ in file.rejected] == [name]
    file = read_spectra(written(sheet(way, "", *beside, (name, 0.5 - 0.2 * BLUE))))
    assert [entry.name for entry in file.entries] == ["red", "blue", name] and not file.rejected
    # Beside a light it is no letter.
    file = read_spectra(written(sheet(way, "", *beside, (name, 0.5 - 0.2 * BLUE), ("D65", BLUE))))
    assert [entry.name for entry in file.entries] == ["red", "blue"] and len(file.rejected) == 2


IDENTIFIERS = [
    "id",
    "ID",
    "Lot no.",
    "lot",
    "batch",
    "Batch number",
    "Serial",
    "sample id",
    "position",
    "row",
    "Nr.",
    "n",
]
IDENTIFIERS += ["Sample_ID", "sampleID", "Lot#", "Batch-No.", "Chargennummer", "Proben-Nr.", "operator id", "year"]


@pytest.mark.parametrize("name", IDENTIFIERS)
@pytest.mark.parametrize("values", [np.full(16, 4711), np.full(16, 17), np.arange(1, 17), np.arange(100, 84, -1)])
def test_a_column_of_identifiers_is_no_sample_and_changes_no_scale(written, name, values):
    for unit, scale in (("", 1.0), (" (%)", 100.0), (" (0..1)", 1.0)):
        for columns in (
            (("red", RED * scale), (name, values), ("blue", BLUE * scale)),
            ((name, values), ("red", RED * scale)),
        ):
            file = read_spectra(written(sheet("down", unit, *columns)))
            assert [entry.name for entry in file.entries] == [one for one, _ in columns if one != name]
            assert not file.rejected and any("left out" in note and name in note for note in file.notes)
            np.testing.assert_allclose(
                next(e for e in file.entries if e.name == "red").spectrum.samples, RED, rtol=1e-9
            )


@pytest.mark.parametrize("name", ["lot", "batch", "sample", "panel", "A", "n"])
def test_a_lot_beside_its_standard_is_a_sample(written, name):
    for unit, scale, digits in (("", 1.0, 4), (" (%)", 100.0, 2), (" (%)", 100.0, 0)):
        columns = ("standard", (RED * scale).round(digits)), (name, (BLUE * scale).round(digits))
        file = read_spectra(written(sheet("down", unit, *columns)))
        assert [entry.name for entry in file.entries] == ["standard", name] and not file.rejected


def test_a_lot_in_whole_percents_in_equal_steps_is_a_sample(written):
    file = read_spectra(written(sheet("down", " (%)", ("standard", range(10, 26)), ("lot", range(11, 27)))))
    assert [entry.name for entry in file.entries] == ["standard", "lot"] and not file.rejected


@pytest.mark.parametrize(
    ("name", "values"),
    [("lot", [*range(3, 18), 12]), ("batch", [1] * 16), ("batch", [100] * 16), ("n", [5, *[7] * 15]), ("id", BLUE)],
)
def test_what_may_be_identifiers_is_asked_about(written, name, values):
    file = read_spectra(written(sheet("down", " (%)", ("red", RED * 100.0), (name, values))))
    assert [entry.name for entry in file.entries] == ["red"]
    ((_, reason),) = file.rejected
    assert reason.problem == "a sample, or a number of samples or rows?"


@pytest.mark.parametrize("way", ["down", "across"])
@pytest.mark.parametrize("dark", [1, 2, 5])
def test_percents_among_fractions_are_asked_about(written, way, dark):
    columns = [("white", [90.0] * 16), *((f"paint {number}", RED) for number in range(dark))]
    path = written(sheet(way, "", *columns))
    with pytest.raises(InputError, match="percent among fractions"):
        read_spectra(path)
    assert len(read_spectra(path, ImportOptions(scale="percent")).entries) == dark + 1
    columns = [("black", RED), *((f"paint {number}", RED * 100.0) for number in range(dark + 1))]
    assert len(read_spectra(written(sheet(way, "", *columns))).entries) == dark + 2


def test_an_illuminant_that_colours_are_for_is_no_name(written):
    rows = [f"{light},{','.join(map(str, RED))}" for light in ("D65", "A")]
    header = f"Illuminant,{','.join(map(str, range(400, 701, 20)))}"
    file = read_spectra(written("\n".join(["Reflectance", header, *rows, ""])))
    assert [entry.name for entry in file.entries] == ["row 1", "row 2"] and not file.rejected
