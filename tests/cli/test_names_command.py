"""`metamer names`: every name that a scene or an option may hold, and the error that leads there."""

import pytest
from metamer.cli.names import KINDS
from metamer.runtime.errors import UnknownNameError
from metamer.spectral.illuminants import illuminant, illuminant_names, light_source_names
from metamer.spectral.observers import OBSERVERS, observer


def listed(out):
    return [line.split("  ")[0] for line in out.splitlines()]


@pytest.mark.parametrize(("what", "names"), [("illuminants", illuminant_names), ("light-sources", light_source_names)])
def test_every_light_is_listed_as_it_is_written(metamer, what, names):
    code, out, _ = metamer("names", what)
    assert code == 0
    assert set(names()) <= set(listed(out))


def test_an_illuminant_stands_beside_its_chromaticity_and_range(metamer):
    (line,) = [line for line in metamer("names", "illuminants")[1].splitlines() if line.startswith("D65 ")]
    assert line.split() == ["D65", "0.3127", "0.3290", "300", "to", "780", "nm", "by", "5"]


def test_without_a_word_everything_is_listed(metamer):
    _, out, _ = metamer("names")
    for what, (title, _) in KINDS.items():
        assert title in out and metamer("names", what)[1].strip() in out
    assert set(OBSERVERS) <= set(listed(out)) and "Bradford" in out and "speed_shape" in out


def test_a_wrong_illuminant_leads_to_the_list():
    with pytest.raises(UnknownNameError, match="`metamer names` lists them"):
        illuminant("D66")


def test_a_wrong_observer_has_few_enough_names_to_be_given_them():
    with pytest.raises(UnknownNameError, match="2015_10"):
        observer("1932_2")
