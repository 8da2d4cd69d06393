"""Small files of text formats, and damage done to them: for tests of readers, and for `fuzz`.

`SMALL` maps a file name to its content, all of it made up here. `mutated(data, random.Random(seed))` damages it.
"""

import random

TABLE_DOWN = "# Reflectance\nWavelength (nm),Red (%),Grey (%)\n400,5.1,20\n410,6.2,20.1\n420,7.3,20.2\n430,8.4,20.3\n"
TABLE_LONG = "Sample;Reading;nm;R (%)\n" + "".join(
    f"{name};{reading};{nm};{nm / 50 + reading}\n"
    for name in ("Red", "P 2")
    for reading in (1, 2)
    for nm in (400, 410, 420)
)
TABLE_ACROSS = (
    "Konica export\nReflectance\nIlluminant: D65\n\nName;L*(10°/D65);a*(10°/D65);b*(10°/D65);400 nm;410 nm;420 nm\n"
    "Rot;40,1;50,2;20,3;0,051;0,062;0,073\nBlau;30,0;1,0;-40,0;0,251;0,262;0,273\n"
)
METER = "Model Name\tCV600\nLUX\t100.0\nCCT\t5000\nX\t96.42\nY\t100.0\nZ\t82.49\nR1\t99\nR2\t98\nR3\t97\n" + "".join(
    f"{nm}nm\t{0.01 * (nm - 370):.4f}\n" for nm in range(380, 400)
)
CHART = """CGATS.17
ORIGINATOR "made for tests"
ILLUMINATION_NAME "D50"
OBSERVER_ANGLE "2"
MEASUREMENT_SOURCE "MeasurementCondition=M1 Filter=no"
MEASUREMENT_GEOMETRY "45/0"
NUMBER_OF_FIELDS 8
BEGIN_DATA_FORMAT
SAMPLE_ID SAMPLE_NAME LAB_L LAB_A LAB_B
SPECTRAL_NM400 SPECTRAL_NM500 SPECTRAL_NM600
END_DATA_FORMAT
NUMBER_OF_SETS 2
BEGIN_DATA
1 "A 1" 50.0 1.0 2.0 0.10 0.20 0.30
2 "B 1" 60.0 1.0 2.0 0.20 0.30 0.40
END_DATA
"""
LAMP = """SPECT

DESCRIPTOR "Spectral power of a lamp"
KEYWORD "SPECTRAL_BANDS"
SPECTRAL_BANDS "4"
SPECTRAL_START_NM "400.0"
SPECTRAL_END_NM "410.0"
SPECTRAL_NORM "50.0"
NUMBER_OF_FIELDS 4
BEGIN_DATA_FORMAT
SPEC_400 SPEC_403 SPEC_407 SPEC_410
END_DATA_FORMAT
NUMBER_OF_SETS 1
BEGIN_DATA
10 50 100 25
END_DATA
"""
GLAZING = (
    "{ Units, Wavelength Units } SI Microns\n{ Thickness } 3.0\n{ Product Name: Clear }\n"
    "0.400 0.80 0.08 0.07\n0.405 0.81 0.08 0.07\n0.410 0.82 0.08 0.07\n"
)

PAIRS = (
    "White,,Blue,\nWavelength (nm),%R,Wavelength (nm),%R\n700,90.5,720,45.5\n699,90.6,719,45.4\n698,90.7,,\n\n"
    "Cary 5000\nScan rate (nm/min),600\n"
)
NUMBERED = (
    "Title;Paints\nNo;Wavelength;Red;Blue\n;[nm];[%];[%]\n1;400;5,1;20\n2;410;6,2;21\n3;420;7,3;22\n"
    "L*(D65/10°);;30;40\na*(D65/10°);;3;4\nb*(D65/10°);;1;2\n"
)
TM27 = (
    '<?xml version="1.0" encoding="UTF-8"?>\n<IESTM2714 xmlns="iestm2714" version="1.0">\n<Header><Manufacturer>Nobody'
    "</Manufacturer></Header><SpectralDistribution><SpectralQuantity>flux</SpectralQuantity><BandwidthFWHM>2.0"
    "</BandwidthFWHM>\n"
    + "".join(f'<SpectralData wavelength="{nm:.1f}">{0.01 * nm:.3f}</SpectralData>\n' for nm in range(400, 701, 20))
    + "</SpectralDistribution></IESTM2714>\n"
)
CXF = (
    '<?xml version="1.0" encoding="UTF-8"?>\n<CxF xmlns="http://colorexchangeformat.com/CxF3-core"><Resources>'
    '<ObjectCollection><Object ObjectType="Standard" Name="red" Id="o1"><CreationDate>2026-01-02T03:04:05Z'
    '</CreationDate><ColorValues><ReflectanceSpectrum ColorSpecification="s">0.05 0.1 0.4 0.8</ReflectanceSpectrum>'
    "</ColorValues></Object></ObjectCollection><ColorSpecificationCollection>"
    '<ColorSpecification Id="s"><MeasurementSpec><MeasurementType>Spectrum_Reflectance</MeasurementType>'
    '<WavelengthRange StartWL="380" Increment="10"/></MeasurementSpec></ColorSpecification>'
    "</ColorSpecificationCollection></Resources></CxF>"
)

SMALL = {
    "pairs.csv": PAIRS.encode(),
    "numbered.csv": NUMBERED.encode(),
    "down.csv": TABLE_DOWN.encode(),
    "long.csv": TABLE_LONG.encode(),
    "across.csv": TABLE_ACROSS.encode(),
    "across-latin.csv": TABLE_ACROSS.encode("cp1252"),
    "utf16.tsv": ("\ufeff" + TABLE_DOWN.replace(",", "\t")).encode("utf-16-le"),
    "meter.txt": METER.encode(),
    "chart.txt": CHART.encode(),
    "lamp.sp": LAMP.encode(),
    "display.ccss": LAMP.replace("SPECT\n", "CCSS\n").encode(),
    "lamp.spd": b"# power\n400 1.0\n410 2.0\n420 1.5\n",
    "clear.usr": GLAZING.encode(),
    "flux.spdx": TM27.encode(),
    "red.cxf": CXF.encode(),
}

_ODD = (b'"', b",", b"\t", b"\n", b";", b"#", b"\r", b"1e999", b"nan", b"-", b"9" * 400, b"\0", b"\xff\xfe", b" " * 300)


def mutated(data: bytes, rng: random.Random) -> bytes:
    """The content with one to twenty places damaged: bytes changed, cut, repeated; lines lost, doubled, moved."""
    held = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 5, 20))):
        held = held or bytearray(b"0")
        at = rng.randrange(len(held))
        kind = rng.randrange(8)
        if kind == 0:
            held[at] = rng.randrange(256)
        elif kind == 1:
            del held[at : at + rng.choice((1, 10, 200))]
        elif kind == 2:
            held[at:at] = bytes(rng.randrange(256) for _ in range(rng.choice((1, 8, 64))))
        elif kind == 3:
            held = held[:at]
        elif kind == 4:
            start = rng.randrange(len(held))
            held[at:at] = held[start : start + rng.choice((10, 200))]
        elif kind == 5:
            held[at : at + 1] = rng.choice(_ODD)
        elif kind == 6:
            old, new = (
                rng.choice((b".", b",", b"\t", b" ", b"\n", b"0")),
                rng.choice((b",", b".", b";", b"", b"\r\n", b"9")),
            )
            held = held.replace(old, new, rng.choice((1, -1)))
        else:
            lines = bytes(held).split(b"\n")
            line = lines.pop(rng.randrange(len(lines)))
            for _ in range(rng.randrange(3)):
                lines.insert(rng.randrange(len(lines) + 1), line)
            held = bytearray(b"\n".join(lines))
    return bytes(held)
