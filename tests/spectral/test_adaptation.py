"""Chromatic adaptation, and the chain's first law: the perfect diffuser under any light comes out white."""

from inspect import unwrap

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from metamer.runtime.errors import InputError, UnknownNameError
from metamer.spectral.adaptation import CONE_FROM_XYZ, adaptation_matrix, degree_of_adaptation
from metamer.spectral.illuminants import illuminant, illuminant_names, light_source_names
from metamer.spectral.observers import OBSERVERS, observer
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM

METHODS = list(CONE_FROM_XYZ)
#: Lights so narrow that a cone channel of that method responds negatively to their white, for every observer:
#: low-pressure sodium, a pair of lines at 589 nm.
WITHOUT_MEANING = {("LPS", "Bradford")}
whites = st.tuples(st.floats(0.7, 1.3), st.just(1.0), st.floats(0.3, 1.5)).map(np.array)


@pytest.fixture(scope="module", params=list(OBSERVERS))
def diffusers(request):
    """Observer's D65 white, and by light the XYZ of the perfect diffuser, as a renderer sums it, and the white."""
    eye = observer(request.param)
    diffuser = np.ones(WORKING_WAVELENGTHS_NM.size)
    lights = {name: illuminant(name) for name in illuminant_names() + light_source_names()}
    return eye.white(lights["D65"]), {
        name: (eye.weights(light, WORKING_WAVELENGTHS_NM) @ diffuser, eye.white(light))
        for name, light in lights.items()
    }


@pytest.mark.parametrize("method", METHODS)
def test_perfect_diffuser_under_every_light_adapts_to_exactly_one(diffusers, method):
    """To equal energy: (1, 1, 1) +- 1e-6; to D65: D65's white +- 1e-6, or the documented refusal."""
    d65, seen_under = diffusers
    assert len(seen_under) == 115
    refused = set()
    for name, (seen, white) in seen_under.items():
        try:
            to_one = adaptation_matrix(white, np.ones(3), method) @ seen
            to_d65 = adaptation_matrix(white, d65, method) @ seen
        except InputError as reason:
            assert "adaptation has no meaning for this white" in str(reason)
            refused.add((name, method))
            continue
        np.testing.assert_allclose(to_one, 1.0, rtol=0, atol=1e-6, err_msg=name)
        np.testing.assert_allclose(to_d65 / d65, 1.0, rtol=0, atol=1e-6, err_msg=name)
    assert refused == {pair for pair in WITHOUT_MEANING if pair[1] == method}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("source", "target"), [("A", "D65"), ("FL11", "D50"), ("D65", "D65"), ("HP1", "D65")])
def test_matrix_against_colour_science(colour, method, source, target):
    eye = observer("1931_2")
    source_white, target_white = eye.white(illuminant(source)), eye.white(illuminant(target))
    # The oracle inverts its own cone matrix; ours must be the same numbers.
    np.testing.assert_array_equal(CONE_FROM_XYZ[method], colour.CHROMATIC_ADAPTATION_TRANSFORMS[method])
    oracle = colour.adaptation.matrix_chromatic_adaptation_VonKries(source_white, target_white, transform=method)
    np.testing.assert_allclose(
        adaptation_matrix(source_white, target_white, method), oracle, rtol=0, atol=1e-7, err_msg=method
    )


def test_bradford_from_d50_to_d65_is_the_published_matrix():
    """ICC D50 to D65, as printed in many profiles."""
    found = adaptation_matrix(np.array([0.96422, 1.0, 0.82521]), np.array([0.95047, 1.0, 1.08883]))
    published = [
        [0.9555766, -0.0230393, 0.0631636],
        [-0.0282895, 1.0099416, 0.0210077],
        [0.0122982, -0.0204830, 1.3299098],
    ]
    np.testing.assert_allclose(found, published, atol=2e-6)


@pytest.mark.parametrize("method", METHODS)
def test_same_white_changes_nothing(method):
    white = np.array([0.95, 1.0, 1.09])
    np.testing.assert_allclose(adaptation_matrix(white, white, method), np.eye(3), atol=1e-13)


@given(source=whites, target=whites)
def test_there_and_back(source, target):
    there, back = adaptation_matrix(source, target), adaptation_matrix(target, source)
    np.testing.assert_allclose(back @ there, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(there @ source, target, atol=1e-13)


@pytest.mark.parametrize("white", [[0.0, 0.0, 0.0], [1.0, 1.0, -0.5], [np.nan, 1.0, 1.0]])
@pytest.mark.parametrize("field", ["white_from_xyz", "white_to_xyz"])
def test_impossible_white_is_named(white, field):
    given_whites = {"white_from_xyz": np.ones(3), "white_to_xyz": np.ones(3), field: np.array(white)}
    with pytest.raises(InputError, match="no meaning for this white") as caught:
        adaptation_matrix(**given_whites)
    assert caught.value.field == field


def test_unknown_method_gives_the_nearest():
    # Behind the check of annotations, which only tests have.
    with pytest.raises(UnknownNameError, match="Bradford, CAT02, CAT16"):
        unwrap(adaptation_matrix)(np.ones(3), np.ones(3), "bradfort")


@given(start=whites, end=whites, method=st.sampled_from(METHODS))
def test_incomplete_adaptation_lies_between_none_and_full(start, end, method):
    """None changes nothing; of full adaptation a white is moved as far as the degree says, on the straight way."""
    np.testing.assert_allclose(adaptation_matrix(start, end, method, 0.0), np.eye(3), atol=1e-12)
    np.testing.assert_array_equal(adaptation_matrix(start, end, method, 1.0), adaptation_matrix(start, end, method))
    np.testing.assert_allclose(adaptation_matrix(start, end, method, 0.25) @ start, start + 0.25 * (end - start))


def test_an_eye_is_used_to_bright_light_more_than_to_dim_one():
    """As colour-science has D of CIECAM02."""
    from colour.appearance.ciecam02 import degree_of_adaptation as reference

    for luminance in (0.0, 3.0, 63.7, 318.3, 1e5):
        for surround in (1.0, 0.9, 0.8):
            wanted = float(np.clip(reference(surround, luminance), 0.0, 1.0))
            assert degree_of_adaptation(luminance, surround) == pytest.approx(wanted, abs=1e-12)
    with pytest.raises(InputError, match="not a degree of adaptation"):
        adaptation_matrix(np.ones(3), np.ones(3), "CAT16", 1.5)
