"""Words of measured files in other languages than English, by language and by what they say.

A language is added as one more block. A word stands by itself; `-` before it: anywhere in a longer one; `-` behind it:
with any ending. A space is also "_", "." or nothing, and letters with marks may be written without them, as many
exports do.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from functools import cache
from typing import Literal, get_args

Role = Literal[
    "wavelength", "reflectance", "transmittance", "radiance", "absorbance", "percent", "derivative", "difference",
    "reading", "counts", "raw", "sample", "reference", "white", "dark", "background",
    "sent on", "scatter", "end", "median", "sum", "mean", "standard", "limit", "aside", "number", "name",
]  # fmt: skip
ROLES: tuple[Role, ...] = get_args(Role)

_TABLE = """
German
    wavelength: wellenl-
    reflectance: -reflexi, -reflektan, -remission
    transmittance: -transm, -durchlicht, -durchlässig
    radiance: -bestrahlung, -strahldichte, -strahlungsleistung
    sent on: reflektiert-, remittiert-, transmittiert-, durchgelassen-
    absorbance: -absorb, extinktion
    percent: prozent
    derivative: -ableitung
    difference: -differenz
    reading: strom, spannung, messung, abgleich, daten, werte, signal
    counts: -zähler, -zählrate, -zählwert
    raw: rohdaten, rohsignal, rohwert, rohspektr
    sample: proben, probe
    reference: referenz
    white: weiß
    dark: dunkel
    background: hintergrund
    scatter: standardabw-, stabw, std abw-, unsicherheit, messunsicherheit, streuung, fehler, messfehler
    scatter: varianz, variationskoeff-, wiederholbarkeit, reproduzierbarkeit, vertrauensbereich, konfidenz-
    end: minimale, maximale, minimaler, maximaler, minimalwert, maximalwert, kleinster wert, größter wert
    median: zentralwert
    sum: summe, anzahl
    mean: mittelwert, mittel, mittlere, mittlerer
    standard: soll, sollwert, zielwert, vorgabe, nennwert, urmuster
    limit: obere, untere, oberer, unterer, obergrenze, untergrenze, grenzwert, abweichung
    aside: bemerkung, anmerkung, zeit, datum, temperatur
    number: nr, nummer
    name: -bezeichnung, -messung, -probe, -muster
French
    wavelength: longueur-
    reflectance: -réflectan, -réflectiv, -réflexi, -rémission
    transmittance: -transm
    radiance: -éclairement, luminance énergétique
    sent on: réfléchi-, transmis, transmise
    absorbance: -absorb
    percent: pour cent, pourcent
    derivative: dérivée
    difference: différence
    reading: courant, spectre, signal, mesure
    counts: coups, coup
    raw: données brutes, signal brut, spectre brut
    sample: échantillon
    reference: référence
    white: blanche, blanc
    dark: noir, obscurité
    background: bruit de fond, arrière-plan
    scatter: écart type, déviation standard, incert-, erreur
    scatter: variance, coefficient de variation, répétabilité, reproductibilité, intervalle de confiance
    end: minimale, maximale
    median: médiane
    sum: somme, nombre de mesures, effectif
    mean: moyenne
    standard: cible, étalon, valeur nominale, consigne
    limit: supérieure, inférieure, limite supérieure, limite inférieure, écart
    aside: remarque, commentaire, heure
    number: numéro, no, n°
    name: nom, échantillon
Spanish
    wavelength: longitud-
    reflectance: -reflectan, -reflectiv, -reflexi
    transmittance: -transm
    radiance: -irradiancia, -radiancia
    sent on: reflejad-, transmitid-
    absorbance: -absorb
    percent: por ciento, porcentaje
    derivative: derivada
    difference: diferencia
    reading: corriente, espectro, señal, medida
    counts: cuentas, cuenta
    raw: datos brutos, datos crudos, señal bruta
    sample: muestra
    reference: referencia
    white: blanca, blanco
    dark: oscuridad, oscuro, oscura
    background: fondo
    scatter: desv est-, desviación est-, desv típ-, desviación típ-, incert-, error
    scatter: varianza, coeficiente de variación, repetibilidad, reproducibilidad, intervalo de confianza
    end: mínimo, máximo
    median: mediana
    sum: suma, recuento
    mean: media, promedio
    standard: objetivo, patrón, estándar, nominal
    limit: superior, inferior, límite superior, límite inferior, desviación
    aside: observación, observaciones, fecha, hora, temperatura
    number: número, núm
    name: nombre, muestra
Italian
    wavelength: lunghezza-
    reflectance: -riflett, -rifless
    transmittance: -transm, -trasm
    radiance: -irradianza, -radianza
    sent on: riflessa, riflesso, trasmessa, trasmesso
    absorbance: -assorb
    percent: per cento, percentuale
    derivative: derivata
    difference: differenza
    reading: corrente, spettro, segnale, misura
    counts: conteggi, conteggio
    raw: dati grezzi, segnale grezzo
    sample: campione
    reference: riferimento
    white: bianco, bianca
    dark: buio, oscuro
    background: fondo
    scatter: deviazione standard, scarto tipo, incert-, errore
    scatter: varianza, coefficiente di variazione, ripetibilità, riproducibilità
    end: minimo, massimo
    median: mediana
    sum: somma, conteggio
    mean: media
    standard: obiettivo, nominale, valore nominale
    limit: superiore, inferiore, limite superiore, limite inferiore, scostamento
    aside: osservazioni, ora, temperatura
    number: numero
    name: nome, campione
Portuguese
    wavelength: comprimento de onda
    reflectance: -refletân, -refletiv, -reflectân, -reflectiv, -reflexão
    transmittance: -transmi
    radiance: -irradiância, -radiância
    sent on: refletid-, transmitid-
    absorbance: -absorb, -absorv
    percent: por cento, porcentagem, percentagem
    derivative: derivada
    difference: diferença
    reading: corrente, espectro, sinal, medida, leitura
    counts: contagens, contagem
    raw: dados brutos, sinal bruto
    sample: amostra
    reference: referência
    white: branco, branca
    dark: escuro, escura, escuridão
    background: fundo
    scatter: desvio padrão, desvio pad, incert-, erro
    scatter: variância, coeficiente de variação, repetibilidade, reprodutibilidade
    end: mínimo, máximo
    median: mediana
    sum: soma, número de medidas
    mean: média
    standard: alvo, padrão, nominal
    limit: superior, inferior, limite superior, limite inferior, desvio
    aside: observação, observações, hora, temperatura
    number: número, núm
    name: nome, amostra
Dutch
    wavelength: golflengte-
    reflectance: -reflectan, -reflectie, -remissie, weerkaatsing
    transmittance: -transm, doorlaat-
    radiance: -irradiantie, -radiantie, bestralingssterkte, stralingsdichtheid
    sent on: gereflecteerd-, doorgelaten
    absorbance: -absorb, extinctie
    percent: procent
    derivative: afgeleide
    difference: verschil
    reading: stroom, signaal, meting, spectrum
    counts: tellingen, telling
    raw: ruwe data, ruw signaal, ruwe
    sample: monster
    reference: referentie
    white: witte, wit
    dark: donker
    background: achtergrond
    scatter: standaardafw-, standaarddev-, stdafw, onzekerheid, fout
    scatter: variantie, variatiecoëff-, herhaalbaarheid, reproduceerbaarheid
    median: mediaan
    sum: som, aantal
    mean: gemiddelde
    standard: doel, doelwaarde, standaard, nominaal
    limit: boven, onder, bovengrens, ondergrens, afwijking
    aside: opmerking, datum, tijd, temperatuur
    number: nummer, nr
    name: -naam, monster
Swedish
    wavelength: våglängd-
    reflectance: -reflektan, -reflektion, -reflexi, -remittans
    transmittance: -transm
    radiance: -irradians, -strålningstäthet, -instrålning
    sent on: reflekterad-, reflekterat, transmitterad-
    absorbance: -absorb
    percent: procent
    derivative: derivata
    difference: skillnad
    reading: ström, signal, mätning, spektrum
    counts: räkningar, räknevärde, pulser
    raw: rådata, råsignal, råvärde, råspektr
    sample: prov
    reference: referens
    white: vitt, vit
    dark: mörkt, mörk, mörker
    background: bakgrund
    scatter: standardavvik-, std avv-, osäkerhet, mätosäkerhet, fel, mätfel
    scatter: varians, variationskoeff-, repeterbarhet, reproducerbarhet
    end: lägsta värde, högsta värde
    sum: summa, antal
    mean: medelvärde, medel
    standard: mål, målvärde, nominellt värde
    limit: övre, undre, övre gräns, undre gräns, avvikelse
    aside: anmärkning, kommentar, tid, datum, temperatur
    number: nummer, nr
    name: -namn, prov, benämning
Danish and Norwegian
    wavelength: bølgelængde-, bølgelengde-
    reflectance: -reflektan, -reflektion, -refleksjon, -refleksion, -remission, -remisjon
    transmittance: -transm
    radiance: -irradians, bestråling-, -strålingstæthed, -strålingstetthet, -innstråling
    sent on: reflekteret, reflekterede, reflektert, transmitteret, transmittert
    absorbance: -absorb
    percent: procent, prosent
    derivative: afledte, deriverte
    difference: forskel, forskjell
    reading: strøm, signal, måling, spektrum
    counts: tællinger, tælling, tellinger, telling
    raw: rådata, råsignal, råverdi, råværdi, råspektr
    sample: prøven, prøve
    reference: referance, referanse, reference
    white: hvidt, hvid, hvitt, hvit
    dark: mørke, mørkt, mørk
    background: baggrund, bakgrunn
    scatter: standardafvig-, standardavvik-, std afv-, std avv-, usikkerhed, usikkerhet, fejl, feil, målefejl, målefeil
    scatter: varians, variationskoeff-, variasjonskoeff-, repeterbarhed, repeterbarhet
    end: mindste værdi, største værdi, minste verdi, største verdi
    sum: sum, antal, antall
    mean: gennemsnit, gjennomsnitt, middelværdi, middelverdi
    standard: mål, målværdi, målverdi, nominel, nominell
    limit: øvre, nedre, øvre grænse, nedre grænse, øvre grense, nedre grense, afvigelse, avvik
    aside: bemærkning, merknad, kommentar, tid, dato, temperatur
    number: nummer, nr
    name: -navn, prøve, betegnelse
Finnish
    wavelength: aallonpituu-
    reflectance: -heijast, -reflektan
    transmittance: -läpäis, -transm
    radiance: -irradians, -radianss, säteilyvoimakkuu-, säteilyteho, säteilytysvoimakkuu-
    sent on: heijastunut, heijastuva, heijastettu, läpäissyt
    absorbance: -absorb
    percent: prosent
    derivative: derivaatta
    difference: erotus
    reading: virta, signaali, mittaus, spektri, lukema
    counts: pulssit, pulssia, laskurilukema
    raw: raakadata, raakasignaali, raaka
    sample: näytteen, näyte
    reference: referenssi, vertailu
    white: valkoisen, valkoinen, valko
    dark: pimeän, pimeä
    background: tausta
    scatter: keskihajonta, hajonta, epävarmuus, mittausepävarmuus, virhe
    scatter: varianssi, variaatiokerroin, toistettavuus, uusittavuus
    end: minimi, maksimi
    median: mediaani
    sum: summa, lukumäärä
    mean: keskiarvo
    standard: tavoite, tavoitearvo, standardi, nimellisarvo
    limit: ylä, ala, yläraja, alaraja, poikkeama
    aside: huomautus, huom, aika, päivämäärä, lämpötila
    number: numero, nro
    name: -nimi, näyte
Polish
    wavelength: długość fali, dł fali, długości fali
    reflectance: -odbici, -reflektanc, -remisj
    transmittance: -transmi, -przepuszczaln
    radiance: -irradianc, -radiancj, -napromieni, -luminancj
    sent on: odbit-, przepuszczon-
    absorbance: -absorb, ekstynkcj-, gęstość optyczna
    percent: procent
    derivative: pochodna
    difference: różnica
    reading: prąd, sygnał, widmo, pomiar
    counts: zliczenia, zliczeń, liczba zliczeń
    raw: dane surowe, surowe dane, surowe, surowy, sygnał surowy
    sample: próbki, próbka, próba
    reference: referencyjny, referencyjne, referencyjna, referencja, referencji, odniesienia, odniesienie
    white: białego, biały, biała, białe, biel
    dark: ciemny, ciemne, ciemna, ciemności
    background: tło, tła
    scatter: odchylenie std-, odchylenie standard-, odch std, odch stand-, niepewność, błąd
    scatter: wariancja, współczynnik zmienności, powtarzalność, odtwarzalność
    end: minimalna, maksymalna, maksimum
    median: mediana
    sum: suma, liczba pomiarów
    mean: średnia, wartość średnia
    standard: cel, wartość docelowa, wzorzec, nominalna
    limit: górna, dolna, górna granica, dolna granica, odchylenie
    aside: uwagi, uwaga, czas, temperatura
    number: numer, nr
    name: nazwa, próbka
Czech
    wavelength: vlnová délka, vlnové délky
    reflectance: -odraz, -reflektan, -remise
    transmittance: -propustnost, -transmi
    radiance: -ozářen, -zářivost, -zářivý výkon
    sent on: odražen-, propuštěn-, prošl-
    absorbance: -absorb, extinkce
    percent: procent
    derivative: derivace
    difference: rozdíl
    reading: proud, signál, měření, spektrum
    counts: počet impulzů, počet impulsů, impulzy, impulsy
    raw: surová data, hrubá data, surový signál, surový
    sample: vzorku, vzorek
    reference: referenční, reference
    white: bílého, bílý, bílá, bílé
    dark: temný, temné, temná, tmavý, tma
    background: pozadí
    scatter: směrodatná odch-, směr odch-, standardní odch-, nejistota, chyba
    scatter: rozptyl, variační koeff-, opakovatelnost, reprodukovatelnost
    median: medián
    sum: součet, počet
    mean: průměr
    standard: cíl, cílová hodnota, nominální
    limit: horní, dolní, horní mez, dolní mez, odchylka
    aside: poznámka, čas, teplota
    number: číslo
    name: název, jméno, vzorek
Russian
    wavelength: длина волны, длины волн, длина волн
    reflectance: -отраж, -отражен
    transmittance: -пропускан
    radiance: -облученность, -энергетическая яркость, -мощность излучения, -плотность излучения
    sent on: отраженн-, отражённ-, прошедш-, пропущенн-
    absorbance: -поглощен, оптическая плотность
    percent: процент-
    derivative: производная
    difference: разность, разница
    reading: ток, сигнал, спектр, измерение
    counts: отсчеты, отсчетов, отсчет, импульсы, импульсов
    raw: сырые данные, исходные данные, необработанные данные, сырой сигнал, исходный сигнал
    sample: образца, образец, пробы, проба
    reference: опорный, опорного, референсный, эталонный, эталона, эталон
    white: белого, белый, белая, белое
    dark: темновой, темновое, темнового, темный
    background: фоновый, фон
    scatter: стандартное отклонение, станд откл, ст откл, ско, с к о, погрешность, неопределенность, ошибка
    scatter: дисперсия, коэффициент вариации, повторяемость, сходимость, воспроизводимость
    end: минимум, максимум, минимальное, максимальное
    median: медиана
    sum: сумма, количество
    mean: среднее, средний, сред
    standard: цель, целевое, эталон, стандарт, номинал
    limit: верхний, нижний, верхний предел, нижний предел, отклонение
    aside: примечание, комментарий, время, дата, температура
    number: номер, №
    name: имя, название, наименование, образец
Turkish
    wavelength: dalga boy-
    reflectance: -yansı, -reflektan
    transmittance: -geçirg, -geçirim, -transmi
    radiance: -ışınım, -ışıma, -irradyans, -radyans
    sent on: yansıyan, yansıtılan, iletilen
    absorbance: -absorb, soğur-
    percent: yüzde
    derivative: türev
    difference: fark
    reading: akımı, akım, sinyali, sinyal, ölçümü, ölçüm, spektrumu, spektrum
    counts: sayımlar, sayım
    raw: ham veri, ham sinyal
    sample: numune, örnek
    reference: referans
    white: beyaz
    dark: karanlık
    background: arka plan
    scatter: standart sapma, std sapma, belirsizlik, hata
    scatter: varyans, tekrarlanabilirlik, varyasyon katsayısı
    end: en küçük, en büyük
    median: medyan, ortanca
    sum: toplam, adet
    mean: ortalama
    standard: hedef, standart, nominal
    limit: üst, alt, üst sınır, alt sınır, sapma
    aside: açıklama, tarih, zaman, sıcaklık
    number: numarası, numara, no
    name: adı, ismi, numune, örnek
Japanese
    wavelength: -波長
    reflectance: -反射
    transmittance: -透過
    radiance: -放射照度, -放射輝度, -放射強度, -照度, -輝度
    sent on: 反射された, 透過した
    absorbance: -吸光, -吸収
    percent: -パーセント
    derivative: -微分
    difference: -差分
    reading: 電流, スペクトル, 信号, 測定値, データ, 値
    counts: -カウント, -計数
    raw: 生データ, 生信号, 生スペクトル
    sample: 試料, サンプル, 測定試料
    reference: 参照, 基準, リファレンス, レファレンス
    white: 白色板, 白色, 白板, ホワイト, 白
    dark: 暗, ダーク
    background: バックグラウンド, 背景
    scatter: 標準偏差, 不確かさ, 偏差, 誤差
    scatter: 分散, 変動係数, 再現性, 繰返し性, 繰り返し性
    end: 最小値, 最小, 最大値, 最大
    median: 中央値
    sum: 合計, 総和
    mean: 平均値, 平均
    standard: 目標, 目標値, 標準, 基準色
    limit: 上限, 下限, 上限値, 下限値, 色差
    aside: 備考, コメント, 日付, 時刻, 日時, 温度
    number: 番号, no
    name: 名前, 名称, 試料, サンプル
Chinese
    wavelength: -波长, -波長
    reflectance: -反射
    transmittance: -透射, -透过, -透光, -穿透率
    radiance: -辐照度, -辐亮度, -辐射亮度, -辐射照度, -輻照度, -輻射
    sent on: 被反射的, 透过的
    absorbance: -吸光, -吸收
    percent: -百分
    derivative: -导数, -導數
    difference: 差值
    reading: 电流, 電流, 光谱, 光譜, 信号, 訊號, 数据, 值
    counts: -计数, -計數
    raw: 原始数据, 原始信号, 原始光谱, 原始
    sample: 样品, 樣品, 样本, 試樣
    reference: 参比, 参考, 参照, 參考
    white: 白板, 白色, 白
    dark: 暗
    background: 背景, 本底
    scatter: 标准偏差, 标准差, 標準差, 不确定度, 误差
    scatter: 方差, 变异系数, 變異係數, 重复性, 重複性
    end: 最小值, 最大值
    median: 中位数, 中值
    sum: 总和, 求和
    mean: 平均值, 均值, 平均
    standard: 目标, 目標, 标准, 標準, 标样
    limit: 上限, 下限, 色差, 偏差
    aside: 备注, 註, 日期, 时间, 温度
    number: 编号, 編號, 序号, 号
    name: 名称, 名稱, 样品, 样本
"""
_MARKED = {
    "ß": "(?:ß|ss)",
    "ø": "(?:ø|oe?|ö)",
    "æ": "(?:æ|ae?)",
    "å": "(?:å|aa?)",
    "ł": "[łl]",
    "ı": "[ıi]",
    "е": "[её]",
}
_MARKED |= {letter: f"(?:{letter}|{plain}e?)" for letter, plain in zip("äöü", "aou", strict=True)}
# Scripts that put no spaces between words begin here.
_CJK = "\u2e80"


@cache
def spelt(*roles: Role, alone: bool = True) -> str:
    """Return a pattern of all words that say one of these in some language, for any case.

    alone : whether letters beside a word make another one of it, as "coupe" of "coup"; else it may be a part of one, as
        in "Dunkelstrom".

    >>> bool(re.search(spelt("reflectance"), "współczynnik odbicia")), bool(re.search(spelt("counts"), "coupe"))
    (True, False)
    """
    words = sorted({word for role in roles for word in _words()[role]}, key=lambda word: (-len(word), word))
    inside = [word for word in words if not alone or word.startswith("-") or word[0] >= _CJK]
    begun = [word for word in words if word not in inside and word.endswith("-")]
    whole = [word for word in words if word not in inside and word not in begun]
    parts = [_any_of(inside)] if inside else []
    parts += [rf"(?<![^\W\d_]){_any_of(begun)}\w*"] if begun else []
    parts += [rf"(?<![^\W\d_]){_any_of(whole)}(?![^\W\d_])"] if whole else []
    return f"(?:{'|'.join(parts)})"


def _any_of(words: Iterable[str]) -> str:
    return f"(?:{'|'.join(''.join(map(_letter, word.strip('-'))) for word in words)})"


#: Words between a thing and what it is of, as in "número de la muestra" and "spectre d'échantillon".
OF = r"(?:(?:d[aeiou]?(?:l{1,2}[aeo]?|s)?(?: l[aeo]s?| el)?|l)[ _'’]+(?:l['’])?)?"


def number_of_sample() -> str:
    """Return a pattern of the words that head the numbers of samples, such as "Probennummer" and "numéro"."""
    sample, number = spelt("sample", alone=False), spelt("number", alone=False)
    return rf"(?:(?:{sample}[ _.-]*)?{number}\.?|{number}[ _.-]*{OF}{sample})"


def words_spoken(text: str) -> int:
    """Return how many words of the table that no English text has are in a text.

    >>> words_spoken("золотой эталон"), words_spoken("reference; Äëèíà âîëíû")
    (1, 0)
    """
    lower = text.lower()
    return sum(word in lower for word in _foreign_words())


@cache
def _foreign_words() -> frozenset[str]:
    """Return words with letters of their own that are too long to be there by chance."""
    words = {word.strip("-") for words in _words().values() for word in words}
    return frozenset(word for word in words if not word.isascii() and len(word) >= (2 if word[0] >= _CJK else 4))


@cache
def _words() -> dict[Role, set[str]]:
    """Return the words of the table by role."""
    lines = [line.strip().split(":") for line in _TABLE.splitlines() if line.startswith(" ")]
    found: dict[Role, set[str]] = {role: set() for role in ROLES}
    for role in ROLES:
        found[role].update(word.strip() for at, words in lines if at == role for word in words.split(","))
    return found


@cache
def _letter(letter: str) -> str:
    """Return a pattern of a letter, with its mark or without."""
    base = unicodedata.normalize("NFD", letter)[0]
    if letter == " ":
        return r"[ _.'’-]{0,2}"
    return _MARKED.get(letter) or (f"[{letter}{base}]" if base != letter and base.isascii() else re.escape(letter))
