import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from metamer.lighting.camera import Camera
from metamer.runtime.errors import InputError

VIEW = {"position": (2, 3, 5), "target": (0.3, -0.2, 0.1), "width": 40, "height_px": 30, "samples": 3}
PERSPECTIVE = Camera(vertical_fov_deg=35, **VIEW)
ORTHOGRAPHIC = Camera(projection="orthographic", height=2.5, **VIEW)
both = pytest.mark.parametrize("camera", [PERSPECTIVE, ORTHOGRAPHIC], ids=["perspective", "orthographic"])


def ndc_of(camera, points):
    clip = np.concatenate([points, np.ones((*points.shape[:-1], 1))], axis=-1) @ camera.clip_from_world().T
    return clip[..., :3] / clip[..., 3:], clip[..., 3]


@both
def test_a_point_on_a_ray_projects_to_that_rays_sample_point(camera):
    origins, directions = camera.rays()
    rows, columns = directions.shape[:2]
    assert (rows, columns) == (90, 120)
    ndc, _ = ndc_of(camera, origins + 4.7 * directions)
    x = 2 * (np.arange(columns) + 0.5) / columns - 1
    y = 1 - 2 * (np.arange(rows) + 0.5) / rows
    np.testing.assert_allclose(ndc[..., 0], np.broadcast_to(x, (rows, columns)), atol=1e-13)
    np.testing.assert_allclose(ndc[..., 1], np.broadcast_to(y[:, None], (rows, columns)), atol=1e-13)
    assert np.abs(ndc[..., 2]).max() < 1


@both
def test_row_0_is_the_top_and_column_0_the_left(camera):
    origins, directions = camera.rays()
    right, up, _ = camera.axes
    points = origins + directions
    assert (points[0, 0] - points[-1, 0]) @ up > 0
    assert (points[0, -1] - points[0, 0]) @ right > 0


@both
def test_depth_runs_from_minus_one_at_near_to_one_at_far(camera):
    near, far = camera.clip_planes
    forward = -camera.axes[2]
    ndc, w = ndc_of(camera, camera.position + np.array([[near], [far]]) * forward)
    np.testing.assert_allclose(ndc[:, 2], [-1, 1], atol=1e-12)
    assert (w > 0).all()


@both
def test_fitted_clip_planes_enclose_the_box(camera):
    low, high = np.array([-1.0, -1, -1]), np.array([1.0, 2, 1])
    fitted = camera.fitted(low, high)
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 2) for z in (-1.0, 1)])
    ndc, _ = ndc_of(fitted, corners)
    assert np.abs(ndc[:, 2]).max() < 1
    assert fitted.far - fitted.near < 1.05 * np.ptp((camera.position - corners) @ camera.axes[2])


def test_given_clip_planes_stay():
    camera = Camera(near=0.5, far=9.0).fitted(-np.ones(3), np.ones(3))
    assert camera.clip_planes == (0.5, 9.0)


@both
def test_bands_of_rows_join_to_the_whole(camera):
    whole = camera.rays()
    bands = [camera.rays(slice(start, start + 7)) for start in range(0, 30, 7)]
    for k in range(2):
        np.testing.assert_array_equal(np.concatenate([band[k] for band in bands]), whole[k])


@both
def test_to_viewer_is_against_the_ray(camera):
    origins, directions = camera.rays()
    np.testing.assert_allclose(camera.to_viewer(origins + 3 * directions), -directions, atol=1e-14)


@settings(max_examples=40, deadline=None)
@given(
    position=st.tuples(*[st.floats(-1e4, 1e4)] * 3),
    target=st.tuples(*[st.floats(-10, 10)] * 3),
    fov=st.floats(0.1, 170),
)
def test_axes_are_orthonormal_and_right_handed(position, target, fov):
    view = np.subtract(target, position)
    if np.linalg.norm(np.cross(view, [0, 1, 0])) < 1e-6 * max(np.linalg.norm(view), 1e-6):
        return
    axes = Camera(position=position, target=target, vertical_fov_deg=fov).axes
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(axes) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("settings", "field", "words"),
    [
        ({"projection": "fisheye"}, "projection", "perspective or orthographic"),
        ({"vertical_fov_deg": 180}, "vertical_fov_deg", "0 to 180"),
        ({"vertical_fov_deg": float("nan")}, "vertical_fov_deg", "out of range"),
        ({"height": 2.0}, "height", "vertical_fov_deg"),
        ({"projection": "orthographic", "vertical_fov_deg": 20.0}, "vertical_fov_deg", "height"),
        ({"projection": "orthographic", "height": -1.0}, "height", "positive"),
        ({"width": 0}, "width", "1 to 16384"),
        ({"samples": 65}, "samples", "1 to 64"),
        ({"position": (0, 0, 0)}, "target", "where the camera stands"),
        ({"position": (0, 4, 0)}, "up", "along the viewing direction"),
        ({"position": (0, float("inf"), 0)}, "position", "three finite numbers"),
        ({"near": 3.0, "far": 2.0}, "near", "below 2.0"),
        ({"near": -1.0}, "near", "> 0"),
    ],
)
def test_a_camera_that_cannot_be_says_which_setting(settings, field, words):
    with pytest.raises(InputError) as caught:
        Camera(**settings)
    assert caught.value.field == field
    assert words in str(caught.value)
    assert caught.value.expected


@both
def test_a_part_of_the_picture_has_the_samples_of_the_whole(camera):
    rows, columns = slice(4, 11), slice(30, 40)
    part = camera.cropped(rows, columns)
    assert (part.width, part.height_px) == (10, 7)
    for mine, whole in zip(part.rays(), camera.rays(), strict=True):
        np.testing.assert_array_equal(mine, whole[12:33, 90:120])
    twice = part.cropped(slice(2, 3), slice(5, None))
    np.testing.assert_array_equal(twice.rays()[1], camera.rays()[1][18:21, 105:120])
    for mine, band in zip(part.rays(slice(2, 5)), part.rays(), strict=True):
        np.testing.assert_array_equal(mine, band[6:15])
    assert part.sample_size == camera.sample_size


@both
def test_a_part_of_the_picture_projects_as_it_looks(camera):
    part = camera.cropped(slice(4, 11), slice(30, 40))
    origins, directions = part.rays()
    ndc, _ = ndc_of(part, origins + 4.7 * directions)
    x, y = 2 * (np.arange(30) + 0.5) / 30 - 1, 1 - 2 * (np.arange(21) + 0.5) / 21
    np.testing.assert_allclose(ndc[..., 0], np.broadcast_to(x, (21, 30)), atol=1e-12)
    np.testing.assert_allclose(ndc[..., 1], np.broadcast_to(y[:, None], (21, 30)), atol=1e-12)
    whole, _ = ndc_of(camera, origins + 4.7 * directions)
    np.testing.assert_allclose(ndc[..., 2], whole[..., 2], atol=1e-12)


@pytest.mark.parametrize("rows", [slice(3, 3), slice(30, 31), slice(5, 2)])
def test_no_part_of_the_picture_is_refused(rows):
    with pytest.raises(InputError, match="no pixel of the picture"):
        PERSPECTIVE.cropped(rows, slice(0, 1))


def test_a_part_beyond_the_picture_is_refused():
    with pytest.raises(InputError, match="beyond the picture"):
        Camera(width=10, height_px=10, part_of=(1, 0, 10, 10))
