"""Tables of something else are told from tables of spectra, and a damaged one of these is never taken for such."""

import random

import pytest
from metamer.spectral.formats.tables.foreign import is_of_something_else
from small_files import SMALL, mutated

STOCK = "part,drawer,left\nscrew M4,A3,120\nnut M4,A4,85\nwasher,B1,300\n"


@pytest.mark.parametrize(
    "content",
    [
        STOCK,
        STOCK.replace(",", ";"),
        STOCK.replace(",", "\t"),
        "who,room\nAda,top floor\nGrace,basement\n",
        '"file","sha"\n"a.brdf","9f3c"\n"b.brdf","77aa"\n',
        "# made by hand\n" + STOCK,
    ],
)
def test_lists_are_of_something_else(written, content):
    assert is_of_something_else(written(content, "list.csv"))


@pytest.mark.parametrize(
    "content",
    [
        "nm,Red\n400,0.1\n410,0.2\n",
        "a,b\n400,0.1\n410,0.2\n420,0.3\n",
        "a,b\n400,x\n410,y\n420,z\n",
        "a,b\n400 0.1,x\n410 0.2,x\n420 0.3,x\n",
        "name,400,410,420\nred,x,y,z\nblue,x,y,z\n",
        "name,R_400,b\nred,x,y\nblue,x,y\n",
        "Reflectance,Red\nlow,x\nhigh,y\n",
        "Wavelength,Red\nlow,x\nhigh,y\n",
        "name,L*,a*,b*\nred,50,60,40\nblue,30,1,-40\n",
        "name,left\n# spectral power\nred,1\nblue,2\n",
        "part,left\nscrew,1\n",
        "part,left\nscrew,1\nnut\n",
        "part left\nscrew 1\nnut 2\n",
        "",
        b"\0\1\2\n\0,\1\n\0,\1\n",
        STOCK + "bolt,C1,5\n" * 250_000,
    ],
)
def test_where_there_is_doubt_it_is_a_table_of_spectra(written, content):
    assert not is_of_something_else(written(content, "list.csv"))


def test_the_name_of_the_file_counts(written):
    assert not is_of_something_else(written(STOCK, "reflectance of paints.csv"))


@pytest.mark.parametrize(
    "name", ["pairs.csv", "numbered.csv", "down.csv", "across.csv", "across-latin.csv", "utf16.tsv"]
)
def test_a_damaged_table_of_spectra_is_not_passed_over(written, name):
    for seed in range(100):
        data = mutated(SMALL[name], random.Random(seed))
        assert not is_of_something_else(written(data, "a.csv")), seed
