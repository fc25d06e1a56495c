"""Pictures of any log on a page: what is seen in them, whatever their encoding, and what cannot be shown."""

from __future__ import annotations

import io
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from manipcli.replay.pixels import MOST_PIXELS, MOST_SIDE, Small, Unshown, from_compressed, from_image

HEIGHT, WIDTH = 24, 40
RGB = np.zeros((HEIGHT, WIDTH, 3), dtype=np.uint8)
RGB[:, :20] = (200, 40, 30)
RGB[:, 20:] = (20, 60, 180)


def seen(small: Small) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(small.data)).convert("RGB")).astype(int)


def rows(pixels: np.ndarray, padding: int = 0) -> tuple[int, memoryview]:
    """Bytes of a row, and the data, with bytes without meaning behind each row."""
    flat = np.ascontiguousarray(pixels).view(np.uint8).reshape(len(pixels), -1)
    padded = np.concatenate([flat, np.full((len(flat), padding), 77, dtype=np.uint8)], axis=1)
    return padded.shape[1], memoryview(padded.tobytes())


@pytest.mark.parametrize("padding", [0, 5])
@pytest.mark.parametrize(
    ("encoding", "pixels"),
    [
        ("rgb8", RGB),
        ("bgr8", RGB[..., ::-1]),
        ("rgba8", np.dstack([RGB, np.full((HEIGHT, WIDTH), 9, dtype=np.uint8)])),
        ("bgra8", np.dstack([RGB[..., ::-1], np.full((HEIGHT, WIDTH), 9, dtype=np.uint8)])),
    ],
)
def test_colours_are_the_same_in_every_encoding(encoding: str, pixels: np.ndarray, padding: int) -> None:
    step, data = rows(pixels, padding)
    small = from_image(encoding, WIDTH, HEIGHT, step, data)
    assert (small.kind, small.size) == ("colour", (WIDTH, HEIGHT))
    assert np.abs(seen(small)[:, [5, 35]] - RGB[:, [5, 35]]).max() < 12  # lossy


@pytest.mark.parametrize("form", ["JPEG", "PNG", "WEBP"])
def test_compressed_pictures_are_read(form: str) -> None:
    stream = io.BytesIO()
    Image.fromarray(RGB).save(stream, form, quality=95)
    small = from_compressed(f"rgb8; {form.lower()} compressed bgr8", memoryview(stream.getvalue()))
    assert np.abs(seen(small)[:, [5, 35]] - RGB[:, [5, 35]]).max() < 16


@pytest.mark.parametrize("big", [False, True])
def test_depth_is_told_in_metres_and_what_is_missing_is_transparent(big: bool) -> None:
    metres = np.tile(np.linspace(0.5, 2.5, WIDTH), (HEIGHT, 1))
    metres[:, :10] = 0.0
    order = ">" if big else "<"
    pictures = [("16UC1", np.rint(1000.0 * metres).astype(f"{order}u2"))]
    with np.errstate(invalid="ignore"):
        pictures.append(("32FC1", np.where(metres > 0.0, metres, np.nan).astype(f"{order}f4")))
    for encoding, pixels in pictures:
        step, data = rows(pixels)
        small = from_image(encoding, WIDTH, HEIGHT, step, data, big=big)
        level, _, _, there = np.moveaxis(np.asarray(Image.open(io.BytesIO(small.data))).astype(int)[12], 1, 0)
        assert there.tolist() == [0] * 10 + [255] * (WIDTH - 10)
        told = small.low + level[10:] / 255 * (small.high - small.low)
        assert told == pytest.approx(metres[12, 10:], abs=0.05)


def test_infrared_is_a_picture_and_no_depth() -> None:
    step, data = rows(np.repeat(np.array([[100, 1000]], dtype="<u2"), 20, axis=1).repeat(HEIGHT, axis=0))
    small = from_image("mono16", WIDTH, HEIGHT, step, data)
    assert small.kind == "colour"
    assert seen(small)[12, [5, 35], 0] == pytest.approx([25, 255], abs=6)


def test_compressed_depth_is_a_png_behind_its_head() -> None:
    stream = io.BytesIO()
    Image.fromarray(np.full((HEIGHT, WIDTH), 1234, dtype=np.uint16)).save(stream, "PNG")
    small = from_compressed("16UC1; compressedDepth png", memoryview(bytes(12) + stream.getvalue()))
    assert small.kind == "depth"
    assert small.low == pytest.approx(1.234, abs=1e-3)


def test_parts_have_colours_of_their_own_and_0_is_white() -> None:
    number = np.repeat(np.arange(4, dtype=np.uint8), WIDTH // 4)[None].repeat(HEIGHT, axis=0)
    step, data = rows(number)
    image = seen(from_image("8UC1", WIDTH, HEIGHT, step, data, labels=True))
    colours = [tuple(image[3, k]) for k in (5, 15, 25, 35)]
    assert len(set(colours)) == 4
    assert colours[0] == (255, 255, 255)


def test_a_large_picture_is_reduced_and_keeps_its_shape() -> None:
    step, data = rows(np.broadcast_to(RGB[:1, :1], (900, 1600, 3)))
    small = from_image("rgb8", 1600, 900, step, data)
    assert max(small.size) <= MOST_SIDE
    assert small.size[0] / small.size[1] == pytest.approx(16 / 9, rel=0.01)


@pytest.mark.parametrize(
    ("encoding", "width", "height", "step", "size"),
    [
        ("rgb8", 40, 24, 120, 120 * 24 - 1),
        ("rgb8", 40, 24, 119, 4000),
        ("rgb8", 40, 24, 0, 4000),
        ("rgb8", 0, 24, 0, 100),
        ("rgb8", 40, 0, 120, 100),
        ("16UC1", 40, 24, 40, 40 * 24),
        ("mono8", 2**32 - 1, 2**32 - 1, 2**32 - 1, 100),
        ("mono8", MOST_PIXELS + 1, 1, MOST_PIXELS + 1, 100),
        ("bayer_rggb8", 40, 24, 40, 960),
        ("", 40, 24, 40, 960),
        ("\x00" * 5000, 40, 24, 40, 960),
    ],
)
def test_sizes_that_do_not_fit_the_data_are_refused(
    encoding: str, width: int, height: int, step: int, size: int
) -> None:
    with pytest.raises(Unshown) as told:
        from_image(encoding, width, height, step, memoryview(bytes(size)))
    assert len(str(told.value)) < 200


def _bomb() -> bytes:
    """A PNG of a few bytes that declares 60,000 x 60,000 pixels."""

    def part(name: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    head = struct.pack(">IIBBBBB", 60_000, 60_000, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", zlib.compress(bytes(100))) + part(b"IEND", b"")


def test_damaged_and_exploding_files_are_refused_without_a_warning(recwarn: pytest.WarningsRecorder) -> None:
    stream = io.BytesIO()
    Image.fromarray(RGB).save(stream, "JPEG")
    whole = stream.getvalue()
    generator = np.random.default_rng(3)
    files = [b"", b"GIF89a", _bomb(), whole[: len(whole) // 2], whole[:30], generator.bytes(500)]
    for _ in range(60):
        broken = bytearray(whole)
        for place in generator.integers(0, len(broken), 6):
            broken[place] = generator.integers(0, 256)
        files.append(bytes(broken))
    refused = 0
    for data in files:
        for form in ("jpeg", "16UC1; compressedDepth png"):
            try:
                assert max(from_compressed(form, memoryview(data)).size) <= MOST_SIDE
            except Unshown:
                refused += 1
    assert refused > 60
    assert not recwarn.list
