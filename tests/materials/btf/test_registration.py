"""Offset of the surface from the measured plane: found, and used where it helps."""

import numpy as np
import pytest
from btf_sets import UBO, held, xml3d_btf
from metamer.materials.btf.decoding import uplifted_basis
from metamer.materials.btf.hemisphere import Hemisphere
from metamer.materials.btf.images import BtfImages, HeldImages, displacement
from metamer.materials.btf.registration import held_out_error, plane_offset, registered
from metamer.materials.formats.btf_names import directions_of
from metamer.spectral.srgb import srgb_to_linear
from scipy.ndimage import gaussian_filter

# h0, and mean, p95 and p99 of held-out views that are asked for.
WANTED = {"wool": (4.0, 4.4, 9.8, 15.5), "corduroy": (5.5, 4.4, 10.4, 17.5)}


def displaced(offset, size=48, views=UBO, noise=0.0, seed=0):
    """(V,H,W) a smooth random picture, seen displaced by each view: exactly, since it is periodic."""
    rng = np.random.default_rng(seed)
    picture = gaussian_filter(rng.normal(size=(size, size)), 1.2, mode="wrap")
    moved = displacement(directions_of(views), offset)
    down, across = np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size)
    spectrum = np.fft.rfft2(picture)
    seen = [np.fft.irfft2(spectrum * np.exp(-2j * np.pi * (across * x + down * y)), (size, size)) for x, y in moved]
    return np.stack(seen) + noise * rng.normal(size=(len(views), size, size)) * picture.std()


@pytest.mark.parametrize("offset", [0.0, 3.3, -4.06, 0.4])
def test_the_plane_is_found_to_a_tenth_of_a_texel(offset):
    assert plane_offset(displaced(offset), directions_of(UBO)) == pytest.approx(offset, abs=0.1)


def test_the_plane_is_found_in_noise_as_strong_as_the_picture():
    assert plane_offset(displaced(2.6, size=64, noise=1.0), directions_of(UBO)) == pytest.approx(2.6, abs=0.2)


@pytest.mark.parametrize(
    ("pictures", "views"),
    [
        (np.ones((81, 32, 32)), UBO),
        (np.zeros((81, 32, 32)), UBO),
        (displaced(1.0, size=8), UBO),
        (np.random.default_rng(0).random((1, 32, 32)), [(0, 0)]),
        (np.random.default_rng(0).random((12, 32, 32)), [(75, phi) for phi in range(0, 360, 30)]),
    ],
    ids=["plain", "black", "8 texels", "one view", "no upright view"],
)
def test_where_there_is_nothing_to_compare_no_plane_is_found(pictures, views):
    assert plane_offset(pictures, directions_of(views)) is None


def of_pictures(pictures, lights=((0, 0), (45, 0))):
    """Images with the same picture under each light."""
    scaled = 0.15 + 0.05 * pictures / np.abs(pictures).max()
    values = scaled[:, None, :, :, None] * np.cos(np.radians([at[0] for at in lights]))[None, :, None, None, None]
    values = np.repeat(values, 3, axis=4).astype(np.float32)
    return HeldImages(Hemisphere(directions_of(UBO)), Hemisphere(directions_of(lights)), values, uplifted_basis())


def test_it_is_used_where_held_out_views_are_predicted_better():
    pictures = displaced(3.3)
    found = registered(of_pictures(pictures), pictures)
    assert found.offset == found.found == pytest.approx(3.3, abs=0.1)
    assert found.after[0] < 0.3 * found.before[0] and "texels above the measured plane" in found.words


def test_it_is_not_used_where_it_does_not_help():
    """Views that have the plane in common, but whose colours are another picture, which is not displaced."""
    pictures = displaced(3.3)
    found = registered(of_pictures(displaced(0.0, seed=1)), pictures)
    assert found.offset == 0.0 and found.found == pytest.approx(3.3, abs=0.1)
    assert found.after[0] > found.before[0] and "of no use" in found.words


def test_noise_has_no_plane_although_to_shift_it_blurs_it():
    """Different noise in each view: shifted between texels, it is predicted better, by any plane."""
    pictures = np.random.default_rng(0).normal(size=(81, 48, 48))
    found = registered(of_pictures(pictures), pictures)
    assert found.offset == 0.0 and (found.after is None or found.after[0] < found.before[0])


def test_few_views_leave_it_unsaid():
    images = held()
    found = registered(images, np.zeros((9, 3, 5)))
    assert found.offset == 0.0 and "not registered" in found.words
    assert held_out_error(held([(0, 0)]), 0.0) is None


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(WANTED))
def test_held_out_views_of_measured_cloths(shared_data, name, load_btf):
    h0, *wanted = WANTED[name]
    images, pictures = load_btf(shared_data / "btf", name)
    found = registered(images, pictures)
    assert abs(found.found - h0) < 0.5
    # Both cloths rise above the plane that was measured.
    assert found.offset == found.found > 0.0
    assert (np.array(found.after) < wanted).all(), found.words


@pytest.fixture
def load_btf():
    """The middle of a cloth that is kept as blocks of principal components, and its views averaged over lights."""

    def load(folder, name, side=80):
        return Blocks(xml3d_btf(folder, name), side).both()

    return load


class Blocks(BtfImages):
    """Blockwise components, whose images are made when they are asked for."""

    def __init__(self, btf, side):
        self.btf, self.height, self.width, self.made = btf, side, side, {}
        self.views = self.lights = Hemisphere(directions_of(UBO))
        self.basis = uplifted_basis()
        first = (btf.n - side) // 2
        rows, columns = np.mgrid[first : first + side, first : first + side]
        self.texels = (rows * btf.n + columns).ravel()

    def _codes(self, view, factors):
        block, at = divmod(view, self.btf.bs)
        left = (self.btf.L[block, self.texels].astype(np.float32) / 255 * 2 - 1) * self.btf.S[block]
        codes = left @ factors(self.btf.R[block, at * 81 : (at + 1) * 81])
        return codes.reshape(self.height, self.width, *codes.shape[1:])

    def image(self, view, light):
        if (view, light) not in self.made:
            codes = self._codes(view, lambda rows: rows[light].T)
            self.made[view, light] = (srgb_to_linear(np.maximum(codes, 0.0)) / np.pi).astype(np.float32)
        return self.made[view, light]

    def both(self):
        return self, np.stack([self._codes(view, lambda rows: rows.mean((0, 1))) for view in range(81)])
