"""Pictures of tables without a block, drawn: textures, light, and what lies about in a workshop. (H, W) or (H, W, 3),
uint8.

Each takes a random generator and gives another picture of its kind; none of them comes from the renderer of blocks.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

WIDTH, HEIGHT = 1280, 960

Picture = NDArray[np.uint8]
Plane = NDArray[np.float32]
Rng = np.random.Generator


def black(rng: Rng) -> Picture:
    """The lamp is off: nothing but a little noise."""
    return _bytes(rng.normal(1.0, rng.uniform(0.0, 1.5), (HEIGHT, WIDTH)).astype(np.float32))


def white(rng: Rng) -> Picture:
    """Overexposed all over."""
    return _bytes(rng.normal(258.0, rng.uniform(0.0, 3.0), (HEIGHT, WIDTH)).astype(np.float32))


def grey(rng: Rng) -> Picture:
    """One level, as a covered lens or a test signal gives it."""
    return np.full((HEIGHT, WIDTH), int(rng.integers(40, 200)), np.uint8)


def noise(rng: Rng) -> Picture:
    """White noise, or noise with grains of a few pixels."""
    return _noisy(
        _plain(rng, 110.0) + float(rng.uniform(20.0, 45.0)) * _grains(rng, float(rng.choice([1.0, 3.0, 6.0])))
    )


def salt(rng: Rng) -> Picture:
    """Single bright and dark pixels, as a broken sensor or cable gives them."""
    picture = _plain(rng, 60.0)
    lot = rng.random(picture.shape)
    picture[lot < 0.02], picture[lot > 0.98] = 255.0, 0.0
    return _noisy(picture, rng)


def compressed(rng: Rng) -> Picture:
    """A noisy table through coarse JPEG: squares of 8 pixels all over."""
    picture = _noisy(_lit(rng, _plain(rng, 70.0) + 6.0 * _grains(rng, 2.0)), rng)
    _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(4, 14))])
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE), np.uint8)


def stripes(rng: Rng) -> Picture:
    """A lamp that flickers under a rolling shutter."""
    y = np.arange(HEIGHT, dtype=np.float32)[:, None]
    wave = 1.0 + 0.4 * np.sin(2 * math.pi * y / float(rng.uniform(20.0, 90.0)))
    return _noisy(_plain(rng, 70.0) * wave.astype(np.float32), rng)


def brushed(rng: Rng) -> Picture:
    """Brushed metal: fine lines one way."""
    lines = rng.normal(0.0, 1.0, (HEIGHT, WIDTH // 24)).astype(np.float32)
    lines = cv2.resize(lines, (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC)
    return _noisy(_lit(rng, _plain(rng, 110.0) + float(rng.uniform(8.0, 20.0)) * lines), rng)


def wood(rng: Rng) -> Picture:
    """Boards of a wooden bench, in colour."""
    x, y = _mesh()
    bend = 30.0 * _grains(rng, 220.0) + float(rng.uniform(0.02, 0.06)) * x
    rings = np.sin((y + bend) / float(rng.uniform(4.0, 9.0))) * 10.0 + 5.0 * _grains(rng, 3.0)
    board = 100.0 + rings + 6.0 * np.sign(np.sin(y / float(rng.uniform(60.0, 110.0))))
    return _coloured(rng, _lit(rng, board.astype(np.float32)), (0.55, 0.85, 1.15))


def weave(rng: Rng) -> Picture:
    """A woven cloth: threads over and under each other."""
    x, y = _turned(rng)
    size = float(rng.uniform(7.0, 16.0))
    over = np.sin(math.pi * x / size) * np.sin(math.pi * y / size) > 0
    thread = np.where(over, np.abs(np.cos(math.pi * x / size)), np.abs(np.cos(math.pi * y / size)))
    return _noisy(_lit(rng, (40.0 + 80.0 * thread + 6.0 * _grains(rng, 2.0)).astype(np.float32)), rng)


def knit(rng: Rng) -> Picture:
    """A knitted cloth: rows of loops."""
    x, y = _turned(rng)
    size = float(rng.uniform(12.0, 24.0))
    loop = np.abs(np.sin(math.pi * (y + 0.35 * size * np.abs(np.sin(math.pi * x / size))) / (0.8 * size)))
    return _coloured(rng, _lit(rng, (30.0 + 110.0 * loop).astype(np.float32)), (1.1, 0.9, 0.7))


def checker_plate(rng: Rng) -> Picture:
    """Steel with raised lozenges, every other one turned."""
    picture = _plain(rng, 75.0) + 3.0 * _grains(rng, 2.0)
    step = float(rng.uniform(34.0, 60.0))
    for row in range(int(HEIGHT / step) + 2):
        for column in range(int(WIDTH / step) + 2):
            angle = 45.0 if (row + column) % 2 else -45.0
            at = (round(column * step), round(row * step))
            cv2.ellipse(picture, at, (round(0.42 * step), round(0.11 * step)), angle, 0, 360, 150.0, -1, cv2.LINE_AA)
    return _noisy(_lit(rng, picture), rng)


def punched_sheet(rng: Rng) -> Picture:
    """A vacuum table of punched sheet metal: holes all over, a third to a half of their pitch wide."""
    x, y = _turned(rng)
    pitch = float(rng.uniform(18.0, 48.0))
    row = np.rint(y / (0.866 * pitch))
    x = x - 0.5 * pitch * (row % 2)
    off = np.hypot(x - np.rint(x / pitch) * pitch, y - row * 0.866 * pitch)
    hole = np.clip(0.5 + float(rng.uniform(0.15, 0.27)) * pitch - off, 0.0, 1.0)
    return _noisy(_lit(rng, (125.0 - 105.0 * hole + 4.0 * _grains(rng, 2.0)).astype(np.float32)), rng)


def grooves(rng: Rng) -> Picture:
    """A vacuum table with grooves both ways: squares all over."""
    x, y = _turned(rng)
    pitch, wide = float(rng.uniform(26.0, 90.0)), float(rng.uniform(1.5, 4.0))
    near = np.minimum(np.abs(x - np.rint(x / pitch) * pitch), np.abs(y - np.rint(y / pitch) * pitch))
    light = 120.0 - 80.0 * np.clip(wide + 0.5 - near, 0.0, 1.0) + 4.0 * _grains(rng, 2.0)
    return _noisy(_lit(rng, light.astype(np.float32)), rng)


def cutting_mat(rng: Rng) -> Picture:
    """A green mat with a printed grid all over, cut marks, in colour."""
    x, y = _turned(rng)
    pitch = float(rng.uniform(22.0, 60.0))
    near = np.minimum(np.abs(x - np.rint(x / pitch) * pitch), np.abs(y - np.rint(y / pitch) * pitch))
    light = 70.0 + 75.0 * np.clip(1.6 - near, 0.0, 1.0) + 3.0 * _grains(rng, 2.0)
    return _coloured(rng, _scratched(rng, _lit(rng, light.astype(np.float32)), 60), (0.8, 1.3, 0.75))


def coloured_table(rng: Rng) -> Picture:
    """A painted table in one strong colour, worn, with chips."""
    tint = np.clip(rng.uniform(0.2, 1.6, 3), 0.2, 1.6)
    light = _scratched(rng, _lit(rng, _plain(rng, 100.0) + 6.0 * _grains(rng, 4.0)), 50)
    return _coloured(rng, _chips(rng, light, 60), (float(tint[0]), float(tint[1]), float(tint[2])))


def dusty(rng: Rng) -> Picture:
    """Dust and shavings all over."""
    light = _chips(rng, _lit(rng, _plain(rng, 35.0) + 3.0 * _grains(rng, 3.0)), int(rng.integers(200, 500)))
    for _ in range(int(rng.integers(1500, 4000))):
        at = (int(rng.integers(0, WIDTH)), int(rng.integers(0, HEIGHT)))
        cv2.circle(light, at, int(rng.integers(1, 3)), float(rng.uniform(60.0, 220.0)), -1, cv2.LINE_AA)
    return _noisy(light, rng)


def scratched(rng: Rng) -> Picture:
    """Years of knives: long scratches that cross each other everywhere."""
    return _noisy(
        _scratched(rng, _lit(rng, _plain(rng, 45.0) + 3.0 * _grains(rng, 3.0)), int(rng.integers(150, 700))), rng
    )


def lettering(rng: Rng) -> Picture:
    """A drawing sheet or a label full of text, and a barcode."""
    picture = _bytes(_plain(rng, 50.0))
    cv2.rectangle(picture, (180, 120), (1080, 820), 205.0, -1)
    size = float(rng.uniform(0.7, 1.6))
    for row in range(int(600 / (34 * size))):
        words = "".join(chr(int(letter)) for letter in rng.integers(33, 126, int(42 / size)))
        at = (215, round(165 + row * 34 * size))
        cv2.putText(picture, words, at, cv2.FONT_HERSHEY_DUPLEX, size, 30.0, max(1, round(2 * size)), cv2.LINE_AA)
    x = 620
    while x < 1030:
        wide = int(rng.integers(2, 9))
        cv2.rectangle(picture, (x, 730), (x + wide, 810), 20.0, -1)
        x += wide + int(rng.integers(2, 9))
    return _noisy(_lit(rng, picture.astype(np.float32)), rng)


def code_squares(rng: Rng) -> Picture:
    """A square code printed large."""
    modules = (rng.random((29, 29)) < 0.5).astype(np.float32) * 190.0 + 20.0
    side = round(29 * float(rng.uniform(9.0, 22.0)))
    picture = _plain(rng, 60.0)
    x, y = int(rng.integers(60, WIDTH - side - 60)), int(rng.integers(60, HEIGHT - side - 60))
    picture[y - 30 : y + side + 30, x - 30 : x + side + 30] = 215.0
    picture[y : y + side, x : x + side] = cv2.resize(modules, (side, side), interpolation=cv2.INTER_NEAREST)
    return _noisy(_lit(rng, cv2.GaussianBlur(picture, (0, 0), 0.8)), rng)


def board(rng: Rng) -> Picture:
    """A calibration board left on the table: black and white squares."""
    squares = np.indices((9, 12)).sum(axis=0).astype(np.float32) % 2 * 180.0 + 25.0
    step = int(rng.integers(40, 62))
    picture = _plain(rng, 60.0)
    picture[120 : 120 + 9 * step, 160 : 160 + 12 * step] = np.kron(squares, np.ones((step, step), np.float32))
    return _noisy(_lit(rng, cv2.GaussianBlur(_tilted(rng, picture), (0, 0), 0.8)), rng)


def hand(rng: Rng) -> Picture:
    """A hand and a sleeve on an empty table, in colour."""
    skin = _hand_mask(rng)
    shade = 1.0 + 0.12 * _grains(rng, 40.0) + 0.04 * _grains(rng, 3.0)
    light = np.where(skin > 0.5, 165.0 * shade, _plain(rng, 45.0) + 3.0 * _grains(rng, 3.0))
    return _coloured(rng, _lit(rng, _softened(light)), (0.75, 0.9, 1.2))


def tools(rng: Rng) -> Picture:
    """Spanner, rule, knife, cable and screws."""
    picture = _plain(rng, 55.0) + 3.0 * _grains(rng, 3.0)
    _rule(rng, picture)
    _spanner(rng, picture)
    _cable(rng, picture)
    for _ in range(12):
        at = rng.uniform((80, 80), (WIDTH - 80, HEIGHT - 80))
        _hexagon(picture, at, float(rng.uniform(9.0, 15.0)), float(rng.uniform(0, 360)), 170.0)
    return _noisy(_lit(rng, _softened(picture)), rng)


def nuts(rng: Rng) -> Picture:
    """A handful of hexagonal nuts and washers spilt over the table."""
    picture = _plain(rng, 45.0) + 3.0 * _grains(rng, 3.0)
    for number in range(int(rng.integers(40, 90))):
        at = rng.uniform((60, 60), (WIDTH - 60, HEIGHT - 60))
        size = float(rng.uniform(14.0, 30.0))
        if number % 3:
            _hexagon(picture, at, size, float(rng.uniform(0, 360)), float(rng.uniform(130, 210)))
        else:
            cv2.circle(picture, _whole(at), round(size), float(rng.uniform(130, 210)), -1, cv2.LINE_AA)
        cv2.circle(picture, _whole(at), round(0.5 * size), 35.0, -1, cv2.LINE_AA)
    return _noisy(_lit(rng, _softened(picture)), rng)


def cables(rng: Rng) -> Picture:
    """A tangle of cables."""
    picture = _plain(rng, 80.0) + 3.0 * _grains(rng, 3.0)
    for _ in range(int(rng.integers(8, 25))):
        _cable(rng, picture)
    return _noisy(_lit(rng, _softened(picture)), rng)


def shadow(rng: Rng) -> Picture:
    """The shadow of somebody who leans over the table, and a lamp mirrored in it."""
    soft = cv2.GaussianBlur(_hand_mask(rng), (0, 0), float(rng.uniform(8.0, 25.0)))
    x, y = _mesh()
    lamp = 120.0 * np.exp(-((x - rng.uniform(0, WIDTH)) ** 2 + (y - rng.uniform(0, HEIGHT)) ** 2) / (2 * 90.0**2))
    light = (_plain(rng, 110.0) + 4.0 * _grains(rng, 3.0)) * (1 - 0.6 * soft) + lamp.astype(np.float32)
    return _noisy(light, rng)


def plain_board(rng: Rng) -> Picture:
    """A smooth sheet of metal or card on the table: a clear outline, but no cells."""
    picture = _plain(rng, 45.0) + 3.0 * _grains(rng, 3.0)
    corners = cv2.boxPoints(
        (
            (WIDTH / 2, HEIGHT / 2),
            (float(rng.uniform(400, 800)), float(rng.uniform(300, 600))),
            float(rng.uniform(0, 90)),
        )
    )
    cv2.fillPoly(picture, [np.rint(corners).astype(np.int32)], float(rng.uniform(120, 200)), cv2.LINE_AA)
    return _noisy(_lit(rng, _softened(picture + 3.0 * _grains(rng, 5.0))), rng)


def _plain(rng: Rng, level: float) -> Plane:
    return np.full((HEIGHT, WIDTH), level * float(rng.uniform(0.8, 1.2)), np.float32)


def _mesh() -> tuple[Plane, Plane]:
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    return x, y


def _turned(rng: Rng) -> tuple[Plane, Plane]:
    x, y = _mesh()
    angle = float(rng.uniform(0.0, math.pi / 2))
    return x * math.cos(angle) - y * math.sin(angle), x * math.sin(angle) + y * math.cos(angle)


def _grains(rng: Rng, size: float) -> Plane:
    small = rng.standard_normal((math.ceil(HEIGHT / size) + 2, math.ceil(WIDTH / size) + 2), dtype=np.float32)
    if size <= 1:
        return small[:HEIGHT, :WIDTH]
    wide = cv2.resize(small, None, fx=size, fy=size, interpolation=cv2.INTER_CUBIC)
    return np.ascontiguousarray(wide[:HEIGHT, :WIDTH])


def _lit(rng: Rng, light: Plane) -> Plane:
    """Under a lamp that stands somewhere: brighter to one side, darker in the corners."""
    x, y = _mesh()
    x, y = x / WIDTH - 0.5, y / WIDTH - 0.375
    slope = rng.uniform(-0.4, 0.4, 2)
    return np.asarray(light * (1 + slope[0] * x + slope[1] * y) * (1 - 0.5 * (x * x + y * y)), np.float32)


def _scratched(rng: Rng, light: Plane, count: int) -> Plane:
    for _ in range(count):
        start = rng.uniform((0, 0), (WIDTH, HEIGHT))
        turn = rng.uniform(0, 2 * math.pi) + rng.uniform(-0.4, 0.4) * np.linspace(0, 1, 9)
        path = start + np.cumsum(np.column_stack((np.cos(turn), np.sin(turn))), axis=0) * rng.uniform(5, 70)
        level = float(light.mean() + rng.uniform(-25, 70))
        cv2.polylines(light, [np.rint(path * 16).astype(np.int32)], False, level, 1, cv2.LINE_AA, 4)
    return light


def _chips(rng: Rng, light: Plane, count: int) -> Plane:
    for _ in range(count):
        start = rng.uniform((0, 0), (WIDTH, HEIGHT))
        turn = rng.uniform(0, 2 * math.pi) + np.cumsum(rng.normal(0, 0.5, 7))
        path = start + np.cumsum(np.column_stack((np.cos(turn), np.sin(turn))), axis=0) * rng.uniform(0.6, 4.0)
        level, wide = float(rng.uniform(90, 230)), int(rng.integers(1, 4))
        cv2.polylines(light, [np.rint(path * 16).astype(np.int32)], False, level, wide, cv2.LINE_AA, 4)
    return light


def _hand_mask(rng: Rng) -> Plane:
    """1 on a hand that reaches in from a side."""
    mask = np.zeros((HEIGHT, WIDTH), np.float32)
    palm = rng.uniform((450, 380), (830, 620))
    along = float(rng.uniform(-0.5, 0.5))
    for finger in np.linspace(-0.55, 0.55, 5):
        reach = 260.0 * (1 - 0.5 * abs(finger)) * (0.75 if finger > 0.5 else 1.0)
        tip = palm + reach * np.array([math.sin(along + finger), -math.cos(along + finger)])
        cv2.line(mask, _whole(palm), _whole(tip), 1.0, int(rng.integers(42, 56)), cv2.LINE_AA)
    cv2.circle(mask, _whole(palm), 115, 1.0, -1, cv2.LINE_AA)
    sleeve = palm + 900.0 * np.array([-math.sin(along), math.cos(along)])
    cv2.line(mask, _whole(palm), _whole(sleeve), 1.0, 150, cv2.LINE_AA)
    return mask


def _rule(rng: Rng, picture: Plane) -> None:
    strip = np.full((60, 760), 190.0, np.float32)
    for tick in range(0, 760, 8):
        cv2.line(strip, (tick, 0), (tick, 26 if tick % 40 == 0 else 14), 30.0, 1)
    angle = float(rng.uniform(-40, 40))
    turn = cv2.getRotationMatrix2D((380, 30), angle, 1.0)
    turn[:, 2] += rng.uniform((180, 120), (400, 500))
    laid = cv2.warpAffine(strip, turn, (WIDTH, HEIGHT), flags=cv2.INTER_LINEAR, borderValue=-1.0)
    picture[laid > 0] = laid[laid > 0]


def _spanner(rng: Rng, picture: Plane) -> None:
    at, angle = rng.uniform((300, 250), (900, 700)), float(rng.uniform(0, math.pi))
    along = 190.0 * np.array([math.cos(angle), math.sin(angle)])
    cv2.line(picture, _whole(at - along), _whole(at + along), 165.0, 34, cv2.LINE_AA)
    for end in (at - along, at + along):
        cv2.circle(picture, _whole(end), 48, 170.0, -1, cv2.LINE_AA)
        _hexagon(picture, end, 26.0, math.degrees(angle), 55.0)


def _cable(rng: Rng, picture: Plane) -> None:
    turn = rng.uniform(0, 2 * math.pi) + np.cumsum(rng.normal(0, 0.35, 40))
    path = rng.uniform((0, 0), (WIDTH, HEIGHT)) + np.cumsum(np.column_stack((np.cos(turn), np.sin(turn))) * 32, axis=0)
    smooth = [np.rint(path * 16).astype(np.int32)]
    wide = int(rng.integers(6, 16))
    level = float(rng.choice([20.0, 150.0, 215.0]))
    cv2.polylines(picture, smooth, False, level, wide, cv2.LINE_AA, 4)
    cv2.polylines(picture, smooth, False, level * 1.2 + 10, max(1, wide // 3), cv2.LINE_AA, 4)


def _hexagon(picture: Plane, at: NDArray[np.float64], size: float, turn_deg: float, level: float) -> None:
    angles = np.radians(turn_deg + np.arange(0, 360, 60))
    corners = at + size * np.column_stack((np.cos(angles), np.sin(angles)))
    cv2.fillPoly(picture, [np.rint(corners * 16).astype(np.int32)], level, cv2.LINE_AA, 4)


def _tilted(rng: Rng, picture: Plane) -> Plane:
    turn = cv2.getRotationMatrix2D((WIDTH / 2, HEIGHT / 2), float(rng.uniform(-12, 12)), 1.0)
    return np.asarray(cv2.warpAffine(picture, turn, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REPLICATE), np.float32)


def _softened(light: NDArray[np.floating]) -> Plane:
    return np.asarray(cv2.GaussianBlur(np.asarray(light, np.float32), (0, 0), 0.9), np.float32)


def _whole(point: NDArray[np.float64]) -> tuple[int, int]:
    x, y = np.rint(point).astype(int).tolist()
    return x, y


def _coloured(rng: Rng, light: Plane, tint: tuple[float, float, float]) -> Picture:
    return np.ascontiguousarray(np.stack([_noisy(light * np.float32(factor), rng) for factor in tint], axis=-1))


def _noisy(light: Plane, rng: Rng | None = None) -> Picture:
    """The plane as bytes, with the noise of a sensor where a generator is given."""
    if rng is None:
        return _bytes(light)
    return _bytes(light + rng.normal(0.0, float(rng.uniform(0.8, 2.0)), light.shape).astype(np.float32))


def _bytes(light: Plane) -> Picture:
    return np.clip(np.rint(light), 0.0, 255.0).astype(np.uint8)
