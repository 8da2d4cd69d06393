"""Relighting by transfer tensors, beside sums over the rays themselves."""

import numpy as np
import pytest
from metamer.benchmarks.papers.transfer_tensors.brdf_tensor import brdf_tensor
from metamer.benchmarks.papers.transfer_tensors.clustered import clustered_tensor
from metamer.benchmarks.papers.transfer_tensors.components import components_of
from metamer.benchmarks.papers.transfer_tensors.disc import Disc
from metamer.benchmarks.papers.transfer_tensors.families import blinn_phong
from metamer.benchmarks.papers.transfer_tensors.parametric import Tuned
from metamer.benchmarks.papers.transfer_tensors.precomputed import ONE_BOUNCE, local, transfer_tensors
from metamer.benchmarks.papers.transfer_tensors.relighting import TensorTransfer
from metamer.lighting.environment.cube import CubeMap
from metamer.lighting.environment.environment import EnvironmentLight
from metamer.lighting.mesh.mesh import Mesh
from metamer.lighting.mesh.shapes import sphere
from metamer.lighting.scene import Part, Scene, bounds_of, framing_camera
from metamer.lighting.transfer.direct import direct_illuminance
from metamer.lighting.transfer.edge_refinement import placed
from metamer.lighting.transfer.operator import irradiance_operator
from metamer.lighting.visibility import refinement
from metamer.lighting.visibility.occluders import Occluders
from metamer.lighting.visibility.sites import scaled_triangles
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.illuminants import illuminant
from metamer.spectral.observers import observer
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM

D65, SEEN = illuminant("D65"), observer("1931_2")
RED = np.interp(NM, [380, 560, 620, 780], [0.04, 0.08, 0.75, 0.8])
BLUE = np.interp(NM, [380, 480, 560, 780], [0.6, 0.65, 0.08, 0.05])
DARK, GREY = np.zeros(len(NM)), np.full(len(NM), 0.4)
EYE, LUX, ACROSS = np.array([2.0, 2.0, 4.0]), 1000.0, 8


def rectangle(*corners):
    vertices = np.array(corners, dtype=float)
    normal = np.cross(vertices[1] - vertices[0], vertices[2] - vertices[0])
    return Mesh(vertices, np.tile(normal / np.linalg.norm(normal), (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]))


FAMILY = blinn_phong(30)


def tuned(diffuse, specular, exponent):
    return Tuned(NM, diffuse, specular, FAMILY, (exponent,))


class Room:
    """A floor, a wall and a ball under a sky that is brighter on one side."""

    def __init__(self):
        fields = np.ones((1, 8, 16))
        fields[0, :4] *= 3.0
        fields[0, 1:3, 2:5] = 20.0
        self.sky = EnvironmentLight(fields, (D65,), LUX)
        ball = sphere(1)
        ball = Mesh(ball.vertices * 0.4 + [0.0, 0.45, 0.0], ball.normals, ball.faces)
        floor = rectangle((-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1))
        wall = rectangle((-1, 0, -1), (1, 0, -1), (1, 2, -1), (-1, 2, -1))
        meshes = floor, wall, ball
        parts = tuple(Part(str(number), mesh, "matt") for number, mesh in enumerate(meshes))
        self.scene = Scene(parts, (self.sky,), (framing_camera(*bounds_of(meshes)),), SEEN)
        self.occluders = Occluders(scaled_triangles(refinement.refined(self.scene)[0]))
        self.hits = placed(self.scene, 0.8).traced(96)
        self.family = FAMILY
        self.components = components_of(self.family)
        self.tensors = transfer_tensors(self.hits, np.arange(3), self.components, self.occluders, ACROSS)
        self.brdf = brdf_tensor(self.family, (3, 8, 8), Disc(16))
        self.transfer = TensorTransfer.of(self.tensors, self.family, self.brdf, self.components)
        self.weights = [SEEN.weights(D65, NM)]
        to = EYE - self.hits.sites.starts
        self.wo = to / np.linalg.norm(to, axis=1, keepdims=True)
        self.seen = np.sum(self.wo * self.hits.sites.normals, axis=1) > 0.0

    def xyz(self, materials, bounces=2):
        return self.transfer.xyz(self.transfer.arriving(self.sky), materials, EYE, self.weights, LUX, bounces)


@pytest.fixture(scope="module")
def room():
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(refinement, "MOST_VERTICES", 50)
        yield Room()


@pytest.mark.slow_cases("0", "1")
@pytest.mark.parametrize("bounces", [0, 1, 2])
def test_matt_surfaces_are_as_by_radiosity(room, bounces):
    """Every bounce, in colour: spectra of sequences of regions fold as they are multiplied."""
    spectra = np.stack([GREY, RED, BLUE])
    radiosity = direct_illuminance(room.scene, room.hits.sites, room.occluders, 512)[0] * spectra[room.tensors.region]
    want, operator = radiosity.copy(), irradiance_operator(room.hits)
    for _ in range(bounces):
        radiosity = np.asarray(operator @ radiosity) * spectra[room.tensors.region]
        want += radiosity
    found = room.xyz([tuned(each, DARK, 5.0) for each in spectra], bounces)
    off = delta_e_xyz((want @ room.weights[0].T / LUX)[room.seen], found[room.seen], SEEN.white(D65))
    assert off.mean() < 0.6
    assert np.percentile(off, 95) < 1.6


def test_a_highlight_is_seen_as_by_its_formula(room):
    """Direct light: the integral over all directions that are free."""
    material = tuned(GREY, np.full(len(NM), 0.3), 20.0)
    cube = CubeMap(32)
    light = cube.means(room.sky)[0] * cube.solid_angles
    some = np.flatnonzero(room.seen)[::4]
    want = np.empty((len(some), 2))
    for row, site in enumerate(some):
        normal = room.hits.sites.normals[site]
        above = np.flatnonzero(cube.directions @ normal > 0.0)
        start = np.repeat(room.hits.sites.starts[site][None], len(above), axis=0)
        above = above[room.occluders.free(start, cube.directions[above])]
        wi = local(cube.directions[above], np.broadcast_to(normal, (len(above), 3)))
        wo = local(room.wo[site][None], normal[None])
        reflected = room.family.weights(20.0) @ room.family.values(wi, np.broadcast_to(wo, wi.shape))
        arriving = light[above] * wi[:, 2]
        want[row] = arriving.sum() / np.pi, reflected @ arriving
    spectra = np.stack([material.diffuse, material.specular])
    truth = want @ spectra @ room.weights[0].T * np.pi / LUX
    found = room.xyz([material] * 3, 0)[some]
    off = delta_e_xyz(truth, np.maximum(found, 0.0), SEEN.white(D65))
    assert off.mean() < 1.2
    assert np.linalg.norm(found - truth) < 0.06 * np.linalg.norm(truth)


@pytest.mark.slow
def test_a_highlight_passes_light_on(room):
    """The floor sends on all that its highlight reflects: by the components, as by the formula."""
    material = tuned(DARK, np.ones(len(NM)), 30.0)
    dark = tuned(DARK, DARK, 1.0)
    matt = tuned(np.full(len(NM), 0.5), DARK, 1.0)
    found = room.xyz([material, matt, dark], 1)[:, 1] - room.xyz([material, matt, dark], 0)[:, 1]
    # A site of the wall that looks at the floor.
    candidates = np.flatnonzero((room.tensors.region == 1) & room.seen)
    site = candidates[np.argmin(np.linalg.norm(room.hits.sites.starts[candidates] - (0.2, -0.5, -0.45), axis=1))]
    light, cube = CubeMap(ONE_BOUNCE).means(room.sky)[0], CubeMap(ONE_BOUNCE)
    corners, shares = (each[0] for each in room.hits.ends(slice(site, site + 1)))
    to = room.hits.directions(slice(site, site + 1))[0]
    total = 0.0
    for ray in np.flatnonzero(shares.sum(axis=1) > 0.0):
        if room.tensors.region[corners[ray, 0]] != 0:
            continue
        for corner, share in zip(corners[ray], shares[ray], strict=True):
            normal = room.hits.sites.normals[corner]
            above = np.flatnonzero(cube.directions @ normal > 0.0)
            start = np.repeat(room.hits.sites.starts[corner][None], len(above), axis=0)
            above = above[room.occluders.free(start, cube.directions[above])]
            wi = local(cube.directions[above], np.broadcast_to(normal, (len(above), 3)))
            wo = local(-to[ray][None], normal[None])
            if wo[0, 2] <= 0.0:
                continue
            reflected = room.family.weights(30.0) @ room.family.values(wi, np.broadcast_to(wo, wi.shape))
            total += share * np.sum(reflected * light[above] * cube.solid_angles[above] * wi[:, 2])
    want = 0.5 * total * np.pi / room.hits.rays / LUX
    assert want > 0.0
    np.testing.assert_allclose(found[site], want, rtol=0.12)


def test_a_closed_material_is_black(room):
    found = room.xyz([tuned(DARK, DARK, 5.0)] * 3)
    np.testing.assert_array_equal(found, 0.0)


def test_materials_change_without_precomputing(room):
    """What arrives is scalar: it knows no material."""
    arriving = room.transfer.arriving(room.sky)
    before = room.transfer.xyz(arriving, [tuned(GREY, DARK, 5.0)] * 3, EYE, room.weights, LUX)
    room.transfer.xyz(arriving, [tuned(RED, GREY, 25.0)] * 3, EYE, room.weights, LUX)
    again = room.transfer.xyz(arriving, [tuned(GREY, DARK, 5.0)] * 3, EYE, room.weights, LUX)
    np.testing.assert_array_equal(again, before)


@pytest.mark.slow
def test_clusters_lose_little_and_say_how_much(room):
    one = room.tensors.one[::2, :, :2]
    errors = []
    for sites in (4, 16, 64):
        found = clustered_tensor(one, 3, sites, 32)
        light = CubeMap(ONE_BOUNCE).means(room.sky)
        truth = np.einsum("nrpls,kl->nrpks", one, light)
        made = found.lit(light)
        errors.append(float(np.linalg.norm(made - truth) / np.linalg.norm(truth)))
        assert found.nbytes < one.nbytes
        assert abs(found.error - _error(found, one)) < 1e-3
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 0.05


def _error(found, one):
    """Squared, of the whole tensor, relative: lit by each texel alone."""
    made = found.lit(np.eye(one.shape[3]))
    return float(np.sum(np.square(made - one, dtype=np.float64)) / np.sum(np.square(one, dtype=np.float64)))
