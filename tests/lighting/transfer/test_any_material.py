"""Any kind of catalogue material on any part: drawn with bounces beside paths, and relit, over rays traced once."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from btf_samples import bumps
from metamer.benchmarks.papers.site_relighting.relighting import Relighting
from metamer.lighting.camera import Camera
from metamer.lighting.mesh import shapes
from metamer.lighting.reference.reference import reference_images
from metamer.lighting.scene import Scene
from metamer.lighting.transfer import transport
from metamer.lighting.transfer.diffuse_albedo import even_albedo
from metamer.materials.analytic import AshikhminShirley
from metamer.materials.analytic.fluorescent import FluorescentLambert
from metamer.materials.btf.form import btf_form
from metamer.materials.core.directions import half_difference, io_from_half_difference, spherical
from metamer.materials.factored.pack import FactoredBrdf, matt_brdf
from metamer.materials.fitting.fit import fit
from metamer.materials.measured.measurement import ScatteredMeasurement
from metamer.materials.measured.merl import MerlBrdf, node_angles
from metamer.materials.measured.rgl import RglBrdf
from metamer.materials.measured.rgl_measurement import RglMeasurement
from metamer.materials.measured.scattered import ScatteredBrdf
from metamer.materials.svbrdf.maps import MappedSurface
from metamer.materials.svbrdf.texel_map import TexelMap
from metamer.materials.svbrdf.texture_form import texture_form
from metamer.spectral.bispectral import fluorophore
from metamer.spectral.difference import delta_e_xyz
from metamer.spectral.palette import Palette
from metamer.spectral.spectrum import Spectrum
from metamer.spectral.wavelengths import WORKING_WAVELENGTHS_NM as NM
from metamer.viewer.render.session import RenderSession
from metamer.viewer.software.backend import software_session

from ...viewer.scenes import lobe_pack, scene_of, sun

RED = np.interp(NM, [380, 560, 620, 780], [0.04, 0.08, 0.75, 0.8])
SIZE = 10
EYE = (1.2, 1.6, 3.2)


def matt(reflectance):
    return matt_brdf(np.ones(1), Palette.of(np.broadcast_to(reflectance, (1, len(NM))) / np.pi))


WHITE, GREY = matt(0.8), matt(0.5)


def fitted(brdf):
    """One term: how near it is to the original is not asked here."""
    return fit(brdf, ranks=(1,), frame="hd", method="weighted", pixels=16).fast


def analytic():
    spectra = (Spectrum.sampled(NM, values, "reflectance") for values in (RED, np.full(len(NM), 0.05)))
    return fitted(AshikhminShirley(*spectra, 20.0, 20.0))


def scattered():
    """A paint at a coarse grid of angles."""
    angles = np.stack(np.meshgrid([10, 40, 75], [8, 41, 75], range(0, 181, 30))).reshape(3, -1)
    theta_i, theta_o, phi = np.radians(angles)
    wi, wo = spherical(theta_i, 0.0 * theta_i), spherical(theta_o, phi)
    theta_h = half_difference(wi, wo)[0]
    values = 0.02 * np.exp(-((np.tan(theta_h) / 0.3) ** 2))[:, None] / wi[:, 2:] / wo[:, 2:] + RED[::10] / np.pi
    nothing = np.zeros(values.shape, bool)
    measured = ScatteredMeasurement(NM[::10], wi, wo, values, nothing, "paint", "made", ("none",))
    return fitted(ScatteredBrdf.from_measurement(measured))


def merl():
    """A red body under a whitish lobe."""
    theta_h, theta_d, phi_d = np.meshgrid(*node_angles(), indexing="ij")
    wi, wo = io_from_half_difference(theta_h, theta_d, phi_d)
    lobe = np.exp(-((np.tan(np.minimum(theta_h, 1.5)) / 0.3) ** 2))
    values = np.array([0.15, 0.03, 0.02]) + 0.2 * lobe[..., None]
    reached = (wi[..., 2] > 1e-9) & (wo[..., 2] > 1e-9)
    return fitted(MerlBrdf(np.where(reached[..., None], values, -1.0), name="made"))


def rgl():
    """Even microfacets, redder towards grazing light."""
    theta = np.radians([0, 30, 60, 90]).astype(np.float32)
    even = {"ndf": (5, 6), "sigma": (5, 6), "vndf": (1, 4, 5, 6), "luminance": (1, 4, 4, 4)}
    fields = {"phi_i": np.zeros(1, np.float32), "theta_i": theta, "jacobian": np.ones(1, np.uint8)}
    fields["description"] = np.frombuffer(b"made", np.uint8)
    fields |= {name: np.ones(shape, np.float32) for name, shape in even.items()}
    colour = np.array([0.5, 0.2, 0.1]) + 0.1 * theta[:, None] * [1.0, 0.0, 0.0]
    fields["rgb"] = np.broadcast_to(colour[None, :, :, None, None], (1, 4, 3, 4, 4)).astype(np.float32)
    whole = RglBrdf(RglMeasurement("made", fields))
    fields["rgb"] = (fields["rgb"] * 0.4 / even_albedo(whole).max()).astype(np.float32)
    return fitted(RglBrdf(RglMeasurement("made", fields)))


def maps(**others):
    """Texels of many colours and roughnesses, dents in them."""
    draw = np.random.default_rng(0)
    dents = draw.normal(size=(8, 8, 3)) * (0.2, 0.2, 0.0) + (0.0, 0.0, 1.0)
    base = TexelMap(draw.integers(60, 220, (8, 8, 3)).astype(np.uint8), srgb=True)
    roughness = TexelMap(draw.integers(120, 255, (8, 8, 1)).astype(np.uint8))
    given = {"normal": TexelMap(dents.astype(np.float32))} | others
    return MappedSurface(NM, base, roughness, "mallett-yuksel", **given).own_form(0.5)


def net():
    """Threads, half of all texels."""
    rows, columns = np.mgrid[0:8, 0:8]
    there = ((rows // 2 % 2 == 0) | (columns // 2 % 2 == 0)).astype(np.uint8) * np.uint8(255)
    return maps(coverage=TexelMap(there[..., None]), cutoff=0.5)


def texture():
    shares = np.random.default_rng(1).dirichlet(np.ones(2), (8, 8))
    return texture_form(NM, shares @ np.stack([RED, RED[::-1]]))


def glowing():
    """Blue comes back red."""

    def about(centre):
        return np.exp(-(((NM - centre) / 40.0) ** 2))

    base = Spectrum.sampled(NM, np.full(len(NM), 0.2), "reflectance")
    return FluorescentLambert(fluorophore(base, 0.7 * about(430), about(610), 0.9))


def btf(name):
    return lambda: btf_form(bumps(6, 8, views=3, lights=3), 0.5, name=name)


KINDS = {
    "factor pack": lambda: FactoredBrdf((*matt(RED).packs, lobe_pack(0.3))),
    "analytic": analytic,
    "measured pairs": scattered,
    "MERL table": merl,
    "RGL table": rgl,
    "maps": maps,
    "spectral texture": texture,
    "BTF, local PCA": btf("lpca"),
    "BTF, polynomials": btf("rfp"),
    "BTF, lobes": btf("rfnl-1"),
    "fluorescent": glowing,
    "cutout mask": net,
}


FITTED = ("analytic", "measured pairs", "MERL table", "RGL table")


@dataclass
class Room:
    """A card that stands on a floor; what has been traced for it so far."""

    scene: Scene
    renderer: RenderSession
    state: Relighting
    traced: list


@pytest.fixture(scope="module")
def room():
    upright = shapes.plane(2.0, 2.0).placed(rotate_deg=(90.0, 0.0, 0.0), translate=(0.0, 0.9, -1.0))
    parts = [(shapes.plane(2.0, 2.0).placed(translate=(0, -0.1, 0)), "floor"), (upright, "card")]
    camera = Camera("c", EYE, (0, 0.4, -0.2), vertical_fov_deg=38.0, width=SIZE, height_px=SIZE, samples=2)
    scene = replace(scene_of(parts, [sun((0.3, 0.6, 0.8))], camera), bounces=1)
    traced, trace = [], transport.kept_hits
    with pytest.MonkeyPatch.context() as patched, software_session() as renderer:
        patched.setattr(transport, "kept_hits", lambda *given: traced.append(given) or trace(*given))
        surfaces = {"floor": WHITE, "card": GREY}
        renderer.render(scene, None, surfaces)
        prepared = transport.Transport.of(scene, 64).prepared
        assert len(traced) == 2
        traced.clear()
        yield Room(scene, renderer, Relighting.of(scene, surfaces, prepared), traced)


@pytest.mark.slow_cases(
    "measured pairs",
    "BTF, local PCA",
    "BTF, lobes",
    "BTF, polynomials",
    "MERL table",
    "maps",
    "cutout mask",
    "RGL table",
)
@pytest.mark.parametrize("kind", KINDS)
def test_any_kind_of_material_on_any_part(room, kind):
    """At sites of the floor: finite, another than before, and nothing is traced. On the card, in a picture beside
    paths over the very form; but for what is drawn as factor packs, which the first of them stands for.
    """
    made, scene = KINDS[kind](), room.scene
    # Paths follow what changes its wavelength in the original alone.
    form = made.own_form() if kind == "fluorescent" else made
    seen = room.state.with_material("part0", form).exits(EYE)
    assert np.isfinite(seen).all() and seen.any()
    assert np.abs(seen - room.state.exits(EYE)).max() > 1e-3
    if kind not in FITTED:
        pictures = []
        for bounces in (1, 0):
            wearing = replace(scene, bounces=bounces)
            found, coverage = room.renderer.render(wearing, None, {"floor": WHITE, "card": form})
            pictures.append(found[coverage == 1.0])
        paths = reference_images(scene, None, {"floor": WHITE, "card": made}, budget=3.0, bounces=1)
        truth, white = paths.xyz[0][coverage == 1.0], scene.adopted_white()
        off, without = (delta_e_xyz(truth, np.maximum(one, 0.0), white) for one in pictures)
        assert paths.noise is not None and paths.noise.mean[0] < 0.3
        assert off.mean() <= 0.6 and np.percentile(off, 95) <= 1.8, (off.mean(), np.percentile(off, 95))
        assert off.mean() < 0.3 * without.mean()
    assert not room.traced
