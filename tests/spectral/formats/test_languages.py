"""Headings in other languages than English: readings are no lamps, scatter is no sample, and reflectance is read."""

import unicodedata

import numpy as np
import pytest
from metamer.runtime.errors import InputError
from metamer.spectral.formats.import_options import ImportOptions
from metamer.spectral.formats.registry import read_spectra
from metamer.spectral.formats.shared.languages import ROLES, spelt
from metamer.spectral.formats.shared.words import measured, quantity_in, unit_in

NM = np.arange(400, 701, 20)
PERCENT = 6.2 + 57.0 / (1.0 + np.exp(-(NM - 583.0) / 13.0))
# Averages of counts are no whole numbers.
DARK, WHITE = 300.37 + 3.0 * np.sin(NM), 3000.61 + NM
SAMPLE = DARK + (WHITE - DARK) * PERCENT / 100.0

# Wavelength, dark, reference, white, sample, raw or counts, reflectance, transmittance, scatter, number of a sample.
LANGUAGES = {
    "German": "Wellenlänge/Dunkelstrom/Referenz/Weißreferenz/Probenspektrum/Rohdaten/Reflexionsgrad/Transmission/"
    "Standardabweichung/Probennummer",
    "French": "Longueur d'onde/courant d'obscurité/spectre de référence/référence blanche/échantillon/coups/"
    "facteur de réflexion/transmittance/écart-type/numéro d'échantillon",
    "Spanish": "Longitud de onda/espectro oscuro/espectro de referencia/blanco/espectro de la muestra/cuentas/"
    "reflectancia/transmitancia/desviación estándar/número de muestra",
    "Italian": "Lunghezza d'onda/buio/spettro di riferimento/riferimento bianco/campione/conteggi/riflettanza/"
    "trasmittanza/deviazione standard/numero campione",
    "Portuguese": "Comprimento de onda (nm)/espectro escuro/referência/branco/amostra/contagens/refletância/"
    "transmitância/desvio padrão/número da amostra",
    "Dutch": "Golflengte (nm)/donkerstroom/referentie/witreferentie/monster/ruwe data/reflectie/transmissie/"
    "standaardafwijking/monsternummer",
    "Swedish": "Våglängd/mörkström/referens/vitreferens/provspektrum/rådata/reflektans/transmittans/standardavvikelse/"
    "provnummer",
    "Danish": "Bølgelængde/mørkestrøm/reference/hvidreference/prøve/tællinger/refleksion/transmittans/"
    "standardafvigelse/prøvenummer",
    "Norwegian": "Bølgelengde/mørkspektrum/referanse/hvitreferanse/prøve/tellinger/refleksjon/transmittans/"
    "standardavvik/prøvenr",
    "Finnish": "Aallonpituus/pimeävirta/vertailu/valkoreferenssi/näyte/raakadata/heijastussuhde/läpäisy/keskihajonta/"
    "näytenumero",
    "Polish": "Długość fali/prąd ciemny/odniesienie/biała referencja/próbka/zliczenia/współczynnik odbicia/"
    "transmitancja/odchylenie standardowe/numer próbki",
    "Czech": "Vlnová délka/temný proud/referenční spektrum/bílá reference/vzorek/surová data/odrazivost/propustnost/"
    "směrodatná odchylka/číslo vzorku",
    "Russian": "Длина волны, нм/тёмновой сигнал/опорный спектр/белый эталон/образец/отсчёты/коэффициент отражения/"
    "коэффициент пропускания/СКО/номер образца",
    "Turkish": "Dalga boyu/karanlık akım/referans/beyaz referans/numune/ham veri/yansıma/geçirgenlik/standart sapma/"
    "numune no",
    "Japanese": "波長/暗電流/参照/白色板/試料/カウント/分光反射率/透過率/標準偏差/試料番号",
    "Chinese": "波长/暗电流/参比/白板/样品/计数/反射率/透过率/标准偏差/样品编号",
}
WORDS = {name: words.split("/") for name, words in LANGUAGES.items()}


def plain(words):
    """Letters without their marks, as many exports write them."""
    folded = words.replace("ß", "ss").translate(str.maketrans("øæåłıё", "oaaliе"))
    bases = (unicodedata.normalize("NFD", letter)[0] for letter in folded)
    return "".join(base if base.isascii() else letter for base, letter in zip(bases, folded, strict=True))


def table(heads, *columns):
    rows = [";".join(f"{cell:.6g}" for cell in row) for row in zip(NM, *columns, strict=True)]
    return "\n".join([";".join(heads), *rows]) + "\n"


@pytest.mark.parametrize("language", WORDS)
def test_readings_and_scatter_are_no_samples(written, language):
    for words in (WORDS[language], list(map(str.upper, WORDS[language])), list(map(plain, WORDS[language]))):
        nm, dark, reference, white, sample, raw, reflectance, _, scatter, _ = words
        heads = (nm, dark, reference, sample, f"{reflectance} (%)", scatter)
        file = read_spectra(written(table(heads, DARK, WHITE, SAMPLE, PERCENT, PERCENT / 90.0), "lamp.csv"))
        (entry,) = file.entries
        assert entry.spectrum.quantity == "reflectance" and not file.rejected
        np.testing.assert_allclose(entry.spectrum.samples, PERCENT / 100.0, rtol=1e-5)
        for names, columns in (((dark, white, sample), (DARK, WHITE, SAMPLE)), ((raw,), (SAMPLE,))):
            for answer in (ImportOptions(), ImportOptions("emission")):
                with pytest.raises(InputError, match=r"readings of an instrument|raw counts are neither"):
                    read_spectra(written(table((nm, *names), *columns), "fluorescent lamp.csv"), answer)


ENCODINGS = ["German cp1252", "French cp1252", "Polish cp1250", "Czech cp1250", "Russian cp1251", "Russian koi8-r",
             "Turkish cp1254", "Japanese cp932", "Japanese euc_jp", "Chinese gb18030", "Japanese utf-16"]  # fmt: skip


@pytest.mark.parametrize("which", ENCODINGS)
def test_words_are_known_in_the_encodings_of_older_systems(written, which):
    language, encoding = which.split()
    nm, dark, _, white, sample, _, reflectance, _, scatter, _ = WORDS[language]
    content = table((nm, f"{reflectance} (%)", scatter), PERCENT, PERCENT / 90.0)
    (entry,) = read_spectra(written(content.encode(encoding))).entries
    assert entry.name == reflectance and entry.spectrum.quantity == "reflectance"
    with pytest.raises(InputError, match="readings of an instrument"):
        read_spectra(written(table((nm, dark, white, sample), DARK, WHITE, SAMPLE).encode(encoding), "lamp.csv"))


@pytest.mark.parametrize("language", ["French", "Swedish", "Polish", "Japanese"])
def test_marks_that_stand_behind_their_letters_are_parts_of_them(written, language):
    nm, dark, _, white, sample, *_ = (unicodedata.normalize("NFD", word) for word in WORDS[language])
    with pytest.raises(InputError, match="readings of an instrument"):
        read_spectra(written(table((nm, dark, white, sample), DARK, WHITE, SAMPLE), "lamp.csv"))


@pytest.mark.parametrize("head", ["反射率（％）", "Ｒ％", "反射率 ［％］", "Reflectance（％）"])
def test_signs_of_full_width_are_as_any_others(written, head):
    (entry,) = read_spectra(written(table(("波長（㎚）", head), PERCENT))).entries
    np.testing.assert_allclose(entry.spectrum.samples, PERCENT / 100.0, rtol=1e-5)
    with pytest.raises(InputError, match="the file states percent, and the numbers say fractions"):
        read_spectra(written(table(("波長（㎚）", head), PERCENT / 100.0)))


@pytest.mark.parametrize("language", WORDS)
def test_numbers_of_samples_are_no_wavelengths(written, language):
    """Samples may be numbered as wavelengths are: the heading of their column tells which way the table goes."""
    *_, number = WORDS[language]
    rows = [";".join([str(at), *(f"{value / at:.5g}" for value in PERCENT)]) for at in range(401, 409)]
    content = "\n".join([";".join([number, *map(str, NM)]), *rows]) + "\n"
    entries = read_spectra(written(content), ImportOptions("reflectance", "fraction")).entries
    assert [entry.name for entry in entries] == [str(at) for at in range(401, 409)]
    np.testing.assert_allclose(entries[0].spectrum.samples, PERCENT / 401.0, rtol=1e-4)


@pytest.mark.parametrize("language", WORDS)
def test_words_tell_the_quantity(language):
    *_, reflectance, transmittance, _, _ = WORDS[language]
    for spelling in (reflectance, reflectance.upper(), f"{reflectance} [0-1]"):
        assert quantity_in(spelling) == "reflectance" == measured(quantity_in(spelling))
    assert quantity_in(transmittance) == "transmittance"


PERCENTS = ["procent", "prosent", "por cento", "per cento", "процент", "パーセント", "百分比", "yüzde"]


def test_percent_is_said_in_words():
    assert [unit_in(f"R ({word})") for word in PERCENTS] == ["percent"] * len(PERCENTS)


@pytest.mark.parametrize(
    "head", ["Dunkelrot", "mörkröd", "coupe", "Provence", "Weißtanne", "white oak", "data", "Paris"]
)
def test_a_word_within_another_is_not_that_word(written, head):
    (entry,) = read_spectra(written(table(("nm", f"{head} R (%)"), PERCENT))).entries
    assert entry.spectrum.quantity == "reflectance"
    two = read_spectra(written("R (%)\n" + table(("nm", head, "sample"), PERCENT, PERCENT))).entries
    assert [entry.name for entry in two] == [head, "sample"]


def test_every_role_has_words():
    assert all(len(spelt(role)) > 40 for role in ROLES)
