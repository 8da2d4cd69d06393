"""Surfaces of maps: what texels scatter, the fast form beside the original, and the hard cases."""

from dataclasses import replace

import numpy as np
import pytest
from metamer.materials.catalogue.catalogue import Catalogue
from metamer.materials.core.directions import spherical
from metamer.materials.core.fast import MOST_TEXELS
from metamer.materials.core.points import Points
from metamer.materials.core.protocol import LIGHTS, measured
from metamer.materials.records.material import MaterialRecord, Provenance
from metamer.materials.records.record import MARKER, write_record
from metamer.materials.svbrdf.map_set import Placement, spectra_of
from metamer.materials.svbrdf.maps import MappedSurface
from metamer.materials.svbrdf.maps_form import MapsForm
from metamer.materials.svbrdf.texel_map import TexelMap
from metamer.runtime.errors import InputError
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.folding import Folding
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.upsampling import METHODS
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM

EXACT = 1e-9
ALIKE = TexelMap.constant
GREY, HALF = ALIKE(0.4, 0.4, 0.4), ALIKE(0.5)


def surface_of(base=GREY, roughness=HALF, uplift="mallett-yuksel", **others):
    return MappedSurface(WORKING_WAVELENGTHS_NM, base, roughness, uplift, **others)


def coloured(size=(12, 16), bits=8, channels=3, seed=0):
    rng, kind = np.random.default_rng(seed), {8: np.uint8, 16: np.uint16}[bits]
    return TexelMap(rng.integers(0, 1 << bits, (*size, channels)).astype(kind), srgb=channels == 3)


def dents(size=(12, 16), depth=0.4, seed=3):
    vectors = np.random.default_rng(seed).normal(size=(*size, 3)) * (depth, depth, 0.0) + (0.0, 0.0, 1.0)
    return TexelMap(vectors.astype(np.float32))


def points_of(count=2000, seed=1, grazing=1.55):
    rng = np.random.default_rng(seed)
    wi, wo = (spherical(rng.uniform(0, grazing, count), rng.uniform(0, 2 * np.pi, count)) for _ in range(2))
    # Half of them about the mirror's direction, where highlights are.
    wo[::2] = wi[::2] * (-1, -1, 1) + rng.normal(0, 0.05, (len(wo[::2]), 3)) * (1, 1, 0)
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    return Points(wi, wo, rng.uniform(-2, 3, (count, 2)))


def off(surface, form, points):
    """ΔE94 of every point under each light."""
    folding = Folding(observer("1931_2"), [illuminant(name) for name in LIGHTS], np.pi)
    truth, shown = surface.xyz(points, folding) * points.wi[:, 2:], form.shaded_xyz(points, folding)
    each = enumerate(folding.lights)
    whites = [folding.observer.white(light) for light in folding.lights]
    return np.array([delta_e_xyz(truth[:, 3 * k : 3 * k + 3], shown[:, 3 * k : 3 * k + 3], whites[k]) for k, _ in each])


@pytest.mark.parametrize("coat", [{}, {"coat": ALIKE(0.7), "coat_roughness": ALIKE(0.3)}], ids=["bare", "coated"])
@pytest.mark.parametrize("metal", [0.0, 1.0])
def test_a_map_of_one_texel_is_the_uniform_material(metal, coat):
    surface = surface_of(metallic=ALIKE(metal), roughness=ALIKE(0.6), **coat)
    points = points_of()
    expected = surface.average().eval(points.wi, points.wo)
    np.testing.assert_allclose(surface.at(points), expected, rtol=1e-6, atol=1e-12)


HARD = {
    "everything": {"normal": dents(), "metallic": coloured(channels=1), "roughness": coloured(channels=1, seed=4)},
    "roughness 0 and 1": {"roughness": TexelMap(np.array([[[0], [255]]], np.uint8).repeat(6, 0))},
    "two axes, turned": {
        "roughness": TexelMap(np.random.default_rng(0).uniform(0.1, 1, (12, 16, 2))),
        "turn": TexelMap(np.random.default_rng(1).uniform(0, 7, (12, 16, 1))),
    },
    "steep normals": {"normal": dents(depth=3.0)},
    "half metal": {"metallic": ALIKE(0.5), "base": coloured()},
    "specular colour and weight": {"reflected": coloured(seed=9), "weight": coloured(channels=1, seed=8)},
    "glossy": {"glossy": True, "reflected": coloured(seed=9)},
    "16 bits": {"base": coloured(bits=16), "roughness": coloured(bits=16, channels=1)},
    "a mask": {"coverage": coloured(channels=1, seed=2), "cutoff": 0.5, "base": coloured()},
    "held and mirrored": {"base": coloured(), "placement": Placement((2.0, -0.5), (0.3, 0.1), ("clamp", "mirror"))},
    "a coat": {"coat": ALIKE(1.0), "base": coloured(), "normal": dents()},
    "a coat with maps": {
        "base": coloured(),
        "normal": dents(),
        "coat": coloured(channels=1, seed=6),
        "coat_roughness": coloured(channels=1, seed=7),
        "coat_normal": dents(depth=0.2, seed=8),
        "coverage": coloured(channels=1, seed=2),
        "cutoff": 0.3,
    },
    "black": {"base": ALIKE(0.0, 0.0, 0.0), "normal": dents()},
}


@pytest.mark.parametrize("name", HARD)
def test_the_fast_form_is_the_original_in_single_precision(name):
    surface = surface_of(**HARD[name])
    points = points_of()
    form = surface.own_form(EXACT)
    assert off(surface, form, points).max() < 0.01, name
    assert form.isotropic == surface.isotropic
    assert np.isfinite(surface.at(points)).all() and surface.at(points).min() >= -1e-9
    again = MappedSurface.from_parameters(surface.parameters())
    np.testing.assert_array_equal(again.at(points), surface.at(points))


def test_grazing_at_89_9_degrees_with_bumps():
    surface = surface_of(**HARD["everything"])
    points = points_of(500)
    low = np.radians(89.9)
    rng = np.random.default_rng(2)
    grazing = replace(points, wi=spherical(np.full(500, low), rng.uniform(0, 6, 500)), _angles={})
    found = surface.at(grazing) * grazing.wi[:, 2:]
    assert np.isfinite(found).all() and off(surface, surface.own_form(EXACT), grazing).max() < 0.01


def test_no_light_comes_from_below_either_horizon():
    lean = TexelMap(np.array([[[0.8, 0.0, 0.6]]]))
    surface = surface_of(normal=lean)
    up = np.array([[0.0, 0.0, 1.0]])
    behind, before = spherical(np.array([1.2]), np.array([np.pi])), spherical(np.array([1.2]), np.array([0.0]))
    at = np.zeros((1, 2))
    assert not surface.at(Points(behind, up, at)).any(), "above the mesh, and below the texel"
    assert surface.at(Points(before, up, at)).all()
    assert not surface.at(Points(before * (1, 1, -1), up, at)).any(), "above the texel, and below the mesh"
    # The texel's cosine weighs the light that arrives.
    matt = replace(surface, weight=ALIKE(0.0))
    cosine = float((before @ [0.8, 0.0, 0.6])[0])
    found = matt.at(Points(before, up, at)) * before[:, 2:]
    np.testing.assert_allclose(found, matt.spectra(np.full((1, 3), 0.4)) / np.pi * cosine, rtol=1e-9)


def test_a_tilted_normal_shows_what_the_tilted_surface_shows():
    """The facets about a leaning normal are those of a surface that leans so."""
    lean = np.array([0.36, 0.48, 0.8])
    surface, flat = surface_of(normal=TexelMap(lean.reshape(1, 1, 3))), surface_of()
    x = np.array([1.0, 0.0, 0.0]) - lean * lean[0]
    frame = np.stack([x / np.linalg.norm(x), np.cross(lean, x / np.linalg.norm(x)), lean])
    points = points_of(400)
    turned = Points(points.wi @ frame.T, points.wo @ frame.T, points.uv)
    both = (turned.wi[:, 2] > 0) & (turned.wo[:, 2] > 0)
    expected = flat.at(turned)[both] * turned.wi[both, 2:] / points.wi[both, 2:]
    np.testing.assert_allclose(surface.at(points)[both], expected, rtol=1e-9)


def test_mirrored_and_overlapping_coordinates_show_the_same_texels():
    surface = surface_of(base=coloured(), normal=dents())
    points = points_of(300)
    np.testing.assert_allclose(
        surface.at(replace(points, uv=points.uv + np.array([3.0, -2.0]), _angles={})),
        surface.at(points),
        rtol=1e-7,
        atol=1e-12,
    )
    mirrored = replace(surface, placement=Placement((-1.0, 1.0), (1.0, 0.0)))
    there = replace(points, uv=1.0 * np.stack([1.0 - points.uv[:, 0], points.uv[:, 1]], axis=1), _angles={})
    np.testing.assert_allclose(mirrored.at(points), surface.at(there), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("vector", "problem"),
    [((0.0, 0.0, 0.0), "a normal without length"), ((0.2, 0.1, -0.5), "points below the surface")],
)
def test_zero_normals_are_named_by_their_place(vector, problem):
    values = np.tile(np.array([0.0, 0.0, 1.0]), (5, 7, 1))
    values[3, 2] = vector
    with pytest.raises(InputError, match=problem) as caught:
        surface_of(normal=TexelMap(values))
    assert caught.value.field == "normal, row 3, column 2"


def test_maps_of_different_sizes_and_other_channels_are_refused():
    with pytest.raises(InputError, match="maps of different sizes"):
        surface_of(base=coloured((4, 4)), metallic=coloured((8, 8), channels=1))
    with pytest.raises(InputError, match="not such a map"):
        surface_of(base=coloured(channels=1))
    with pytest.raises(InputError, match="not a finite number"):
        TexelMap(np.full((2, 2, 1), np.nan))


def test_a_texture_larger_than_the_gpu_takes_is_refused():
    wide = TexelMap(np.zeros((1, MOST_TEXELS + 1, 1), np.uint8))
    wide.values[0, 5] = 9
    form = surface_of(metallic=wide).own_form()
    with pytest.raises(InputError, match="a texture too large for the GPU"):
        form.maps.shader()


@pytest.mark.parametrize("method", METHODS)
def test_reflectances_of_every_method_stay_below_1(method):
    rgb = np.random.default_rng(0).uniform(size=(300, 3)) ** 0.3
    made = spectra_of(rgb, method, WORKING_WAVELENGTHS_NM)
    assert made.max() < 1 + 1e-6 and made.min() > -1e-6
    surface = surface_of(base=coloured(), uplift=method)
    assert measured(surface.own_form(), surface, 32).error.p99 < 0.25


def test_measured_colours_stay_what_they_are():
    """A base colour of spectra at other wavelengths, beside grey facets."""
    nm = np.arange(400.0, 701.0, 20.0)
    shares = np.random.default_rng(0).dirichlet(np.ones(3), (6, 5))
    dyes = 0.05 + 0.6 * np.exp(-(((nm - np.array([[450.0], [540.0], [630.0]])) / 40.0) ** 2))
    surface = MappedSurface(nm, TexelMap(shares @ dyes), HALF, "")
    assert surface.own_form().rank == 5, "three dyes, the facets' grey beside them, and the last term"
    assert off(surface, surface.own_form(EXACT), points_of(500)).max() < 0.01
    middle = Points(*np.tile([[0.0, 0.0, 1.0]], (2, 1, 1)), np.array([[0.5 / 5, 1 - 0.5 / 6]]))
    matt = replace(surface, weight=ALIKE(0.0))
    np.testing.assert_allclose(matt.at(middle)[0] * np.pi, (shares @ dyes)[0, 0], rtol=1e-12)


def test_half_precision_is_kept_where_it_stays_within_the_budget():
    smooth = surface_of(base=coloured(), roughness=ALIKE(0.6))
    assert smooth.own_form().maps.precision == "half"
    assert smooth.own_form(1e-3).maps.precision == "single"
    assert surface_of(**HARD["two axes, turned"]).own_form().maps.precision == "single"


def test_the_catalogue_keeps_it_and_shows_its_average(tmp_path):
    surface = surface_of(**HARD["everything"], base=coloured())
    fast = measured(surface.own_form(), surface, 32)
    said = Provenance("a test", "none", "uplifted(mallett-yuksel)")
    made = MaterialRecord("maps/hammered", "maps", "maps", surface.parameters(), said, fast)
    (tmp_path / MARKER).write_text("schema = 2\n")
    (tmp_path / "maps").mkdir()
    write_record(made, tmp_path / "maps" / "hammered.h5")
    catalogue = Catalogue.open(tmp_path)
    found = catalogue["maps/hammered"]
    assert isinstance(found.fast, MapsForm) and found.error == fast.error
    np.testing.assert_array_equal(found.fast.maps.planes, fast.maps.planes)
    points = points_of(100)
    np.testing.assert_array_equal(found.surface().at(points), surface.at(points))
    np.testing.assert_array_equal(found.fast.shaded(points), fast.shaded(points))
    assert catalogue.verify() == {"maps/hammered": None}
    assert np.isfinite(found.lab("D65")).all() and not found.fast.average().uses_uv
