"""What was measured is never guessed: what each kind of file is taken for, or refused with the words that settle it."""

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
