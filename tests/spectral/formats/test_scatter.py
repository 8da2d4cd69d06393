"""Scatter, limits and ends of readings are no samples; light that a surface sends on is no reflectance."""

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats.registry import read_spectra
from metamer.spectral.formats.shared.words import names_raw, quantity_in

NM = np.arange(400, 701, 50)
RED = 6.2 + 57.0 / (1.0 + np.exp(-(NM - 583.0) / 13.0))
BLUE = 80.0 - 0.5 * RED

# Names of sets after two samples: those that are left out are marked.
SETS = ["Mean,*StdDev", "Average,*Std Dev", "MEAN,*STDEV", "Mean,*Tolerance", "*MIN,*MAX", "Mean,*Min,*Max",
        "*Minimum,*Maximum", "Avg,*Range", "*Upper limit,*Lower limit", "*Tolerance +,*Tolerance -",
        "blue mean,*blue stdev,*blue min,*blue max", "Mittelwert,*Standardabweichung", "Moyenne,*Écart type",
        "*standard deviation of readings", "min red", "Max", "Mountain range", "tolerant red", "Mean,*Median,*P95,*SE",
        "Average,*n=10,*red CV", "*95th percentile", "*Percentile 95", "*Repeatability", "*RMS", "*red % RSD",
        "Mean,*Sum", "*Coefficient of variation", "*Rel. difference", "*Upper 95% CI", "Median,*Q1,*Q3", "Median",
        "*red-Deriv1", "*dE", "Mean,P10,P11", "Q1,Q3", "Sum", "Mittelwert,*Zentralwert,*Varianz,*Summe",
        "Moyenne,*Médiane,*Répétabilité", "Media,*Mediana,*Máximo,*Varianza",
        "Media,*Somma,*Varianza,*Ripetibilità", "Média,*Mínimo,*Variância",
        "Gemiddelde,*Mediaan,*Herhaalbaarheid", "Medelvärde,*Summa,*Varians", "Gennemsnit,*Antal,*Repeterbarhed",
        "Keskiarvo,*Mediaani,*Toistettavuus", "Średnia,*Mediana,*Wariancja", "Průměr,*Medián,*Rozptyl",
        "Среднее,*Медиана,*Дисперсия,*Сходимость", "Ortalama,*Medyan,*Varyans", "平均,*中央値,*最大値,*再現性",
        "平均值,*中位数,*最小值,*方差", "Mean R%,*SD R%,*P95 R%,*N", "*CV R%", "*Variance of reflectance", "Std R%",
        "Mean,P1,P2,P3", "Q1,Q2,Q3,Mean", "Mittlere Reflexion,*Maximale Reflexion,*Streuung der Reflexion",
        "Mean,*Number of readings", "Target,*Lower,*Upper", "Nominal,*LSL,*USL,*Delta", "Standard,*Ratio,*High,*Low",
        "Target R%,*Lower R%,*Upper R%,*Delta R%", "Target,*Lower tol.,*Upper spec", "upper,lower", "Delta",
        "Sollwert,*Untere,*Obere,*Abweichung", "Cible,*Supérieure,*Inférieure",
        "Patrón,*Superior,*Inferior",
        "Nominale,*Superiore,*Inferiore", "Alvo,*Superior,*Desvio", "Standaard,*Bovengrens,*Ondergrens",
        "Målvärde,*Övre gräns,*Undre gräns", "Målværdi,*Øvre grænse,*Nedre grænse", "Målverdi,*Avvik,*Øvre grense",
        "Tavoite,*Yläraja,*Alaraja", "Wzorzec,*Górna granica,*Odchylenie", "Cílová hodnota,*Horní mez,*Dolní mez",
        "Эталон,*Верхний предел,*Отклонение", "Hedef,*Üst sınır,*Alt sınır", "目標値,*上限,*下限",
        "标准,*上限,*偏差"]  # fmt: skip


def chart(names, *columns, keywords="", fields=()):
    heads = [*(["SAMPLE_NAME", *fields]), *(f"SPECTRAL_NM{nm}" for nm in NM)]
    rows = [
        " ".join([*(f'"{word}"' for word in name.split("|")), *(f"{value:.4f}" for value in values)])
        for name, values in zip(names, columns, strict=True)
    ]
    return (
        f'CGATS.17\nMEASUREMENT_TYPE "Reflectance"\n{keywords}SPECTRAL_NORM 100\nNUMBER_OF_FIELDS {len(heads)}\n'
        f"BEGIN_DATA_FORMAT\n{' '.join(heads)}\nEND_DATA_FORMAT\nNUMBER_OF_SETS {len(rows)}\nBEGIN_DATA\n"
        + "\n".join(rows)
        + "\nEND_DATA\n"
    )


def across(names, *columns):
    rows = [
        ",".join([name, *(f"{value:.4f}" for value in values)]) for name, values in zip(names, columns, strict=True)
    ]
    return "Reflectance (%)\n" + "\n".join([",".join(["Name", *map(str, NM)]), *rows]) + "\n"


def down(heads, *columns):
    rows = [",".join(f"{value:.6g}" for value in row) for row in zip(NM, *columns, strict=True)]
    return "\n".join([",".join(heads), *rows]) + "\n"


@pytest.mark.parametrize("sets", SETS)
def test_statistics_behind_samples_are_none(written, sets):
    names = ["red", "blue", *sets.replace("*", "").split(",")]
    kept = ["red", "blue", *(name for name in sets.split(",") if name[0] != "*")]
    columns = [RED, BLUE, *([RED / 9.0] * (len(names) - 2))]
    table = "Reflectance (%)\n" + down(["nm", *names], *columns)
    for content, name in ((chart(names, *columns), "a.txt"), (across(names, *columns), "a.csv"), (table, "b.csv")):
        file = read_spectra(written(content, name))
        assert [entry.name for entry in file.entries] == kept and not file.rejected
        assert all(any(left_out in note for note in file.notes) for left_out in set(names) - set(kept))


@pytest.mark.parametrize("kinds", ["Mean,Std", "Average,StdDev", "Mean,Max", "Mittelwert,Streuung"])
@pytest.mark.parametrize("first", ["", "nm"])
def test_words_above_names_say_which_columns_are_scatter(written, kinds, first):
    kept, left = kinds.split(",")
    heads = [",".join([first, kept, "", left, ""]), ",".join(["" if first else "nm", "red", "blue", "red", "blue"])]
    rows = down([], RED, BLUE, RED / 9.0, BLUE / 9.0).lstrip()
    file = read_spectra(written("\n".join(["Reflectance (%)", *heads, rows])))
    assert [entry.name for entry in file.entries] == [f"{kept} red", f"{kept} blue"]
    assert any(f"{left} red, {left} blue" in note for note in file.notes)


ABOVE = {
    "Reflectance (%),,Transmittance (%),": ["reflectance", "reflectance", "transmittance", "transmittance"],
    "Reflectance (%),Transmittance (%),,": ["reflectance", "transmittance", "transmittance", "transmittance"],
    "%T,,,%R": ["transmittance", "transmittance", "transmittance", "reflectance"],
    "Reflectance (%),,,Absorbance": ["reflectance", "reflectance", "reflectance"],
    "Reflectance (%),,Counts,": ["reflectance", "reflectance"],
}


@pytest.mark.parametrize("above", ABOVE)
@pytest.mark.parametrize("first", ["", "nm"])
def test_a_quantity_above_several_columns_is_of_each(written, above, first):
    heads = [f"{first},{above}", ",".join(["" if first else "nm", "red", "blue", "green", "grey"])]
    columns = RED, BLUE, RED + 3.0, BLUE + 3.0
    file = read_spectra(written("\n".join([*heads, down([], *columns).lstrip()])))
    assert [entry.spectrum.quantity for entry in file.entries] == ABOVE[above]
    for entry, column in zip(file.entries, columns, strict=False):
        np.testing.assert_allclose(entry.spectrum.samples, column / 100.0, rtol=1e-5)


def test_a_column_says_which_statistic_a_set_is(written):
    names = ["red|mean", "red|stdev", "red|min", "red|max"]
    for field in ("STATISTIC", "DATA_TYPE", "VALUE_KIND"):
        file = read_spectra(written(chart(names, *([RED] * 4), fields=(field,)), "a.txt"))
        assert len(file.entries) == 1


@pytest.mark.parametrize("line", ["Standard deviation", "StdDev of 10 readings", "Standardabweichung", "Uncertainty"])
def test_a_table_may_be_of_scatter_by_its_title(written, line):
    both = f"Reflectance (%)\nMean\n{down(['nm', 'red'], RED)}\n{line}\n{down(['nm', 'red'], RED / 50.0)}"
    charts = chart(["red"], RED) + chart(["red"], RED / 50.0, keywords=f'DESCRIPTOR "{line}"\n')
    for content, name in ((both, "a.csv"), (charts, "a.txt")):
        (entry,) = read_spectra(written(content, name)).entries
        np.testing.assert_allclose(entry.spectrum.samples, RED / 100.0, rtol=1e-4)
    for content in (f"{line}\nReflectance (%)\n{down(['nm', 'red'], RED)}", down(["nm", f"Reflectance {line}"], RED)):
        with pytest.raises(InputError, match="is no measurement of a colour"):
            read_spectra(written(content))


@pytest.mark.parametrize("verb", ["Reflected", "transmitted", "Backreflected"])
def test_light_that_is_sent_on_is_no_reflectance(verb):
    for words in ("{} radiance", "{} light (W/m2/nm)", "Irradiance {} by the panel", "{} luminance [cd/m2]"):
        assert quantity_in(words.format(verb)) == "emission"
    for words in ("{} power (mW)", "{} light", "{} intensity", "{} signal", "{} flux"):
        assert quantity_in(words.format(verb)) is None
    surface = "transmittance" if verb == "transmitted" else "reflectance"
    for words in ("{} (%)", "{} light (%)", "{} power [0-1]", f"{{}} {surface}"):
        assert quantity_in(words.format(verb)) == surface


@pytest.mark.parametrize(
    ("heading", "raw", "quantity"),
    [
        ("Reflection (mV)", "counts", None),
        ("Reflectance [nA]", "counts", None),
        ("Transmission (volts)", "counts", None),
        ("Reflectance signal", "counts", None),
        ("Remissionssignal", "counts", None),
        ("Intensity (mV)", "counts", None),
        ("Reflectance (A)", None, "reflectance"),
        ("Reflectance (V)", None, "reflectance"),
        ("Reflectance (signal/reference)", None, "reflectance"),
        ("Reflection intensity (W/m2)", None, None),
        ("Reflectance (W m-2 nm-1)", None, None),
        ("Reflectance (W matt)", None, "reflectance"),
        ("反射放射輝度", None, None),
        ("Radianza riflessa", None, "emission"),
        ("отражённая яркость", None, None),
        ("luce riflessa", None, None),
        ("reflektiertes Licht", None, None),
        ("Reflected sunshine", None, None),
        ("Luminance réfléchie", None, "emission"),
        ("reflektierte Strahldichte", None, "emission"),
        ("riflessione diffusa", None, "reflectance"),
        ("Transmission diffuse", None, "transmittance"),
        ("коэффициент отражения", None, "reflectance"),
        ("Fattore di radianza", None, "radiance factor"),
        ("facteur de luminance", None, "radiance factor"),
        ("Factor de radiancia", None, "radiance factor"),
    ],
)
def test_signals_and_powers_of_a_surface_are_no_reflectance(written, heading, raw, quantity):
    assert names_raw(heading) == raw and (raw or quantity_in(heading) == quantity)
    path = written(
        "\n".join([f"nm,{heading}", *(f"{nm},{value:.3f}" for nm, value in zip(NM, RED / 100.0, strict=True))])
    )
    if quantity is None:
        with pytest.raises(InputError):
            read_spectra(path)
    else:
        (entry,) = read_spectra(path).entries
        assert quantity in entry.taken
        np.testing.assert_allclose(entry.spectrum.samples, RED / 100.0, atol=1e-3)


def test_a_luminance_factor_is_of_no_lamp():
    assert quantity_in("Luminance factor") == quantity_in("Leuchtdichtefaktor") == "radiance factor"
    assert quantity_in("Luminance") == "emission"


@pytest.mark.parametrize("between", ["\t", ","])
@pytest.mark.parametrize("names", ["Red,Blue", "Red,,Blue", "Red,,Blue,"])
def test_names_above_pairs_of_columns_are_of_each_pair(written, names, between):
    heads = '"Wavelength nm."\t"R%"\t"Wavelength nm."\t"R%"'
    rows = [f"{nm}\t{red:.3f}\t{nm}\t{blue:.3f}" for nm, red, blue in zip(NM, RED, BLUE, strict=True)]
    above = names.replace(",", "\t")
    content = "\n".join([above, heads, *rows]).replace("\t", between) + "\n"
    entries = read_spectra(written(content)).entries
    assert [entry.name for entry in entries] == ["Red", "Blue"]
    np.testing.assert_allclose(entries[0].spectrum.samples, RED / 100.0, atol=1e-5)


def test_a_scope_reading_of_a_sample_is_no_lamp(written):
    content = '"CH1" "Smp" scope\n' + "".join(
        f"  {nm:.2f}   {600.3 * red:.6E}\n" for nm, red in zip(NM, RED, strict=True)
    )
    with pytest.raises(InputError, match="readings of an instrument"):
        read_spectra(written(content, "fluorescent lamp.SSM"))
