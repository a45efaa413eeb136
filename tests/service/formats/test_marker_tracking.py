"""Dots of synthetic images: how exactly they are found, and whether each stays itself."""

import numpy as np
import pytest

pytest.importorskip("cv2", reason="opencv-python-headless is not installed: pip install 'stiction[images]'")

from scipy.spatial import cKDTree

from service.formats import marker_tracking
from service.formats.marker_images import Grey
from service.formats.marker_tracking import Dots, DotTracks, find_dots, track
from slipcore.errors import InvalidInput
from slipcore.frames import FloatArray
from tests.service.formats.dot_images import PITCH, SHAPE, draw, jittered, lattice, sheared_press


def order(found: FloatArray, true: FloatArray) -> np.ndarray:
    """Which true dot each found one is; each is found once."""
    distance, index = cKDTree(true).query(found)
    assert len(found) == len(true) == len(set(index))
    assert distance.max() < 1.0
    return np.asarray(index)


def error(found: FloatArray, true: FloatArray) -> float:
    """Root mean square of coordinates, px, of those that are seen."""
    return float(np.sqrt(np.nanmean((found - true) ** 2)))


@pytest.mark.parametrize("dark", [True, False], ids=["dark", "light"])
@pytest.mark.parametrize("radius", [2.0, 3.5, 5.0])
@pytest.mark.parametrize(("noise", "bound"), [(0.0, 0.02), (0.02, 0.06)], ids=["clean", "noisy"])
def test_centroids_are_exact_to_a_part_of_a_pixel(dark: bool, radius: float, noise: float, bound: float) -> None:
    true = lattice() + np.random.default_rng(2).uniform(-0.5, 0.5, (400, 2))
    dots = find_dots(draw(true, radius=radius, dark=dark, noise=noise))
    assert dots.dark == dark
    assert dots.pitch == pytest.approx(PITCH, rel=0.05)
    assert error(dots.rest, true[order(dots.rest, true)]) < bound


@pytest.mark.parametrize(
    ("rest", "noise", "bound"),
    [(lattice(10, 10), 0.0, 0.05), (jittered(rows=10, columns=10), 0.02, 0.1)],
    ids=["lattice, clean", "jittered, noisy"],
)
def test_each_dot_stays_itself_over_a_hundred_frames(rest: FloatArray, noise: float, bound: float) -> None:
    true = sheared_press(rest, 100)
    assert np.linalg.norm(true[-1] - true[0], axis=1).max() > PITCH / 2
    seen = track(draw(place, (250, 260), noise=noise, seed=number) for number, place in enumerate(true))
    index = order(seen.place[0], rest)
    assert np.isfinite(seen.place).mean() > 0.999
    assert error(seen.place, true[:, index]) < bound
    assert np.nanmax(np.abs(seen.place - true[:, index])) < 1.0
    assert seen.largest_step < 0.1 * PITCH


def hidden(image: Grey, place: FloatArray, level: int) -> Grey:
    """The image with a square patch of one grey level, as wide as the pitch, over a place."""
    x, y = np.rint(place).astype(int)
    image = image.copy()
    image[y - 10 : y + 11, x - 10 : x + 11] = level
    return image


@pytest.mark.parametrize("level", [180, 20], ids=["as the ground", "dark"])
def test_a_dot_that_is_hidden_is_lost_and_found_again(level: int) -> None:
    true = sheared_press(lattice(10, 10), 60)
    which, away = 45, range(10, 50)
    images = [draw(place, (250, 260)) for place in true]
    seen = track(hidden(image, true[t, which], level) if t in away else image for t, image in enumerate(images))
    index = order(seen.place[0], true[0])
    lost = np.isnan(seen.place[..., 0])
    expected = np.zeros_like(lost)
    expected[10:50, index == which] = True
    assert np.array_equal(lost, expected)
    assert error(seen.place, true[:, index]) < 0.05


def test_all_are_found_again_after_frames_without_light() -> None:
    true = sheared_press(lattice(), 40)
    dark = np.zeros(SHAPE, dtype=np.uint8)
    seen = track(dark if t in (20, 21) else draw(place) for t, place in enumerate(true))
    assert np.isnan(seen.place[20:22]).all()
    assert error(seen.place[22:], true[22:, order(seen.place[0], true[0])]) < 0.05


def test_dots_whose_light_grows_dim_are_followed() -> None:
    true = sheared_press(lattice(), 20)
    share = np.linspace(1.0, 0.6, 20)
    seen = track((draw(place) * s).astype(np.uint8) for place, s in zip(true, share, strict=True))
    assert error(seen.place, true[:, order(seen.place[0], true[0])]) < 0.05
    assert np.isfinite(seen.place).all()


def test_a_step_that_is_as_long_as_flow_can_see_is_told() -> None:
    rest = lattice()
    seen = track([draw(rest), draw(rest + np.array([6.0, 0.0]))])
    assert seen.largest_step == pytest.approx(6.0, abs=0.1)


@pytest.mark.parametrize(
    "image",
    [
        np.zeros(SHAPE, dtype=np.uint8),
        np.broadcast_to(np.linspace(0, 255, SHAPE[1]).astype(np.uint8), SHAPE),
        np.random.default_rng(0).integers(0, 256, SHAPE).astype(np.uint8),
        np.random.default_rng(0).normal(128, 5, SHAPE).astype(np.uint8),
        np.zeros((1, 1), dtype=np.uint8),
        np.zeros((3, 400), dtype=np.uint8),
        draw(lattice(1, 2)),
    ],
    ids=["black", "slope", "any grey", "noise", "one pixel", "a line", "two dots"],
)
def test_an_image_with_too_few_dots_is_refused(image: Grey) -> None:
    with pytest.raises(InvalidInput, match=r"markers is \d+ \w+ dots in the first image; allowed: at least 3 dots"):
        find_dots(image)


def test_three_dots_are_enough() -> None:
    assert len(find_dots(draw(lattice(1, 3))).rest) == 3


def test_dots_that_the_border_cuts_are_left_out() -> None:
    true = lattice()
    cut = np.array([[0.0, 100.0], [200.0, 1.0], [459.0, 300.0], [100.0, 449.0]])
    assert len(find_dots(draw(np.concatenate([true, cut]))).rest) == len(true)


def test_no_images_and_too_many_places_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InvalidInput, match="images is without any frame"):
        track([])
    monkeypatch.setattr(marker_tracking, "MAX_ROWS", 1000)
    with pytest.raises(InvalidInput, match="images is over 2 with 400 markers; allowed: 1000 places"):
        track([draw(lattice())] * 5)


def test_what_is_tracked_is_a_record_of_the_first_image_and_all_places() -> None:
    seen = track([draw(lattice())] * 2)
    assert isinstance(seen, DotTracks)
    assert isinstance(seen.dots, Dots)
    assert np.array_equal(seen.place[0], seen.dots.rest)
    assert error(seen.place[1], seen.place[0]) < 1e-6


def test_a_scratch_is_no_row_of_dots() -> None:
    image = draw(lattice(10, 10), noise=0.01)  # in the upper left quarter
    image[300:304, 60:400] -= 80
    assert len(find_dots(image, dark=True).rest) == 100


@pytest.mark.parametrize("value", [0, 128, 255])
def test_a_large_image_without_any_dot_is_refused_before_it_is_blurred(
    monkeypatch: pytest.MonkeyPatch, value: int
) -> None:
    monkeypatch.setattr(marker_tracking, "_blurred", None)
    blank = np.full((700, 700), value, dtype=np.uint8)
    blank[::2] += np.uint8(2 if value < 255 else 254)  # rounding of a grey between
    with pytest.raises(InvalidInput, match="markers is 0 light dots in the first image; allowed: at least 3"):
        find_dots(blank)


def test_a_wide_blur_is_that_of_the_whole_image_in_a_part_of_its_time() -> None:
    image = np.random.default_rng(1).uniform(0.0, 255.0, (900, 1100)).astype(np.float32)
    image += np.linspace(0.0, 200.0, 1100, dtype=np.float32)
    for deviation in (65.0, 150.0):
        exact = marker_tracking.cv2.GaussianBlur(image, (0, 0), deviation)
        assert np.abs(marker_tracking._blurred(image, deviation) - exact).max() < 0.5
