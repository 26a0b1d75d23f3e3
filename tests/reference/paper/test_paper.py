# SPDX-License-Identifier: Apache-2.0
"""What the figures of the course paper show, measured on small versions of them."""
import farm
import image
import make
import numpy as np
import pytest

BALLS = [10, 20, 30, 40, 50]


@pytest.fixture(scope="module")
def renders():
    """The variants of a figure as arrays."""
    with farm.Farm() as service:
        yield lambda figure, **more: [image.read(service.render(envelope, 120))
                                      for envelope in make.envelopes(figure, **more)]


def ball_outline(scene, index, width, height):
    """A ball's centre and radius in pixels."""
    camera = scene["camera"]
    ball = [o for o in scene["objects"] if o["type"] == "sphere"][index]
    eye, target = np.array(camera["position"]), np.array(camera["look_at"])
    z = (target - eye) / np.linalg.norm(target - eye)
    x = np.cross(z, camera["up"])
    x /= np.linalg.norm(x)
    arm = np.array(ball["center"]) - eye
    depth = arm @ z
    scale = width / 2 / np.tan(np.radians(camera["horizontal_fov"] / 2))
    return (width / 2 + scale * (arm @ x) / depth,
            height / 2 - scale * (arm @ np.cross(x, z)) / depth, scale * ball["radius"] / depth)


def sharpness(pixels, scene, index):
    """Steepest vertical change across the upper edge of a ball, where it meets the sky or floor."""
    x, y, radius = ball_outline(scene, index, pixels.shape[1], pixels.shape[0])
    columns = slice(int(x - radius / 5), int(x + radius / 5) + 1)
    top = int(y - radius)
    rows = slice(max(top - 12, 0), top + 12)
    profile = pixels[rows, columns].mean(axis=1)
    return np.abs(np.diff(profile, axis=0)).sum(axis=1).max()


def test_stratified_samples_smooth_edges(renders):
    """Broken by samples that are not stratified: random ones have a variance of 1/16 and 1/64.

    The error is taken against 1024 samples. On edges n x n cells of side 1/n leave a variance of
    the order n^-3, far below the n^-2 of random samples.
    """
    size = {"image": {"width": 100, "height": 100}}
    one, four, eight = renders("antialiasing", **size)
    with farm.Farm() as service:
        scene = make.envelopes("antialiasing", **size)[0]
        scene["override"] = {"sampling": {"samples": 1024, "sequence": "sobol"}}
        truth = image.read(service.render(scene))
    error = [((pixels - truth) ** 2).mean() for pixels in (one, four, eight)]
    assert error[1] < error[0] / 24
    assert error[2] < error[1] / 6


def test_blur_grows_with_the_aperture(renders):
    """Broken by a lens that ignores its radius, or that blurs what lies at the focal distance.

    The ball at 10 is blurred over more than the rows that sharpness looks at. The outline of the
    ball in focus lies a little nearer than 20 and softens a little too.
    """
    scene = make.envelopes("aperture")[0]["scene"]
    variants = renders("aperture", sampling={"samples": 96})
    for index in (2, 3, 4):
        edges = [sharpness(pixels, scene, index) for pixels in variants]
        assert edges[0] > 1.15 * edges[1] > 1.15 ** 2 * edges[2], f"ball at {BALLS[index]}: {edges}"
    edges = [sharpness(pixels, scene, 1) for pixels in variants]
    assert min(edges) > 0.75 * max(edges), f"the ball in focus: {edges}"


def test_focus_moves_with_the_focal_distance(renders):
    """Broken by a focal sphere at another distance: each ball is sharpest where it is in focus."""
    scene = make.envelopes("focus")[0]["scene"]
    variants = renders("focus", sampling={"samples": 96})
    for index, focused in ((1, 0), (2, 1), (3, 2)):
        edges = [sharpness(pixels, scene, index) for pixels in variants]
        assert int(np.argmax(edges)) == focused, f"ball at {BALLS[index]}: {edges}"
