"""Pictures of every kind: read to the number, or refused by name."""

import struct
import sys
import zlib
from io import BytesIO
from itertools import product
from pathlib import Path
from typing import Any

import imagecodecs
import numpy as np
import pytest
import tifffile
from PIL import Image

from tbcad.cad.formats.pictures import decoded, picture_of, read_picture, visible_files
from tbcad.errors import InputError
from tbcad.rig.control.photographs import image_facts
from tests.raw_photographs import dng

RANDOM = np.random.default_rng(5)
RGB = RANDOM.integers(0, 256, (12, 20, 3), dtype=np.uint8)
DEEP = RANDOM.integers(0, 65_536, (12, 20, 4), dtype=np.uint16)
GREY = np.ascontiguousarray(RGB[..., 0])
IMAGE = Image.fromarray(RGB)
BLACK, WHITE = 512, 16_383
RED, GREEN, BLUE = 1_000, 3_000, 14_000  # beyond the share of white from which LibRaw moves it


def saved(image: Image.Image, kind: str, **options: Any) -> bytes:
    file = BytesIO()
    image.save(file, kind, **options)
    return file.getvalue()


def tiff(pixels: np.ndarray, **options: Any) -> bytes:
    file = BytesIO()
    tifffile.imwrite(file, pixels, **options)
    return file.getvalue()


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def deep_png(pixels: np.ndarray, chunk: bytes = b"") -> bytes:
    """A PNG of 16 bits a channel (h, w, n), with a chunk after its head."""
    data: bytes = imagecodecs.png_encode(np.ascontiguousarray(pixels))
    return data[:33] + chunk + data[33:]


def packed_tiff(values: np.ndarray, bits: int, order: str) -> bytes:
    """Grey values (h, w) of some bits each, without gaps but at the ends of rows."""
    rows = ["".join(f"{value:0{bits}b}" for value in row) for row in values]
    padded = (row.ljust(-(-len(row) // 8) * 8, "0") for row in rows)
    data = b"".join(int(row, 2).to_bytes(len(row) // 8, "big") for row in padded)
    data += b"\0" * (len(data) % 2)
    height, width = values.shape
    tags = [(256, width), (257, height), (258, bits), (259, 1), (262, 1), (273, 8), (277, 1)]
    tags += [(278, height), (279, len(data))]
    head = (b"II*\0" if order == "<" else b"MM\0*") + struct.pack(order + "I", 8 + len(data))
    entries = b"".join(struct.pack(order + "HHII", tag, 4, 1, value) for tag, value in tags)
    return head + data + struct.pack(order + "H", len(tags)) + entries + bytes(4)


def check(data: bytes, expected: np.ndarray, name: str = "picture") -> None:
    found = picture_of(data, name)
    assert found.dtype == expected.dtype
    assert found.dtype.isnative
    assert np.array_equal(found, expected)


@pytest.mark.parametrize("kind", ["PNG", "TIFF", "BMP"])
@pytest.mark.parametrize("mode", ["1", "L", "P", "RGB"])
def test_modes_of_8_bits(mode: str, kind: str) -> None:
    image = Image.fromarray(RGB).convert(mode)
    expected = np.asarray(image.convert("RGB" if mode in {"P", "RGB"} else "L"))
    check(saved(image, kind), expected)
    assert np.array_equal(decoded(image, "in memory"), expected)


@pytest.mark.parametrize("mode", ["LA", "RGBA", "La", "RGBa", "PA", "RGBX"])
def test_opaque_pixels_lose_what_says_so(mode: str) -> None:
    colours = Image.fromarray(RGB).convert("P" if mode == "PA" else "RGB")
    opaque = colours.convert({"La": "LA", "RGBa": "RGBA"}.get(mode, mode)).convert(mode)
    expected = colours.convert("L" if mode in {"LA", "La"} else "RGB")
    assert np.array_equal(decoded(opaque, "picture"), np.asarray(expected))


@pytest.mark.parametrize(
    "data",
    [
        saved(Image.fromarray(np.dstack([RGB, GREY])), "PNG"),
        saved(Image.fromarray(RGB).quantize(8), "PNG", transparency=0),
        saved(Image.fromarray(GREY), "PNG", transparency=int(GREY[3, 3])),
        deep_png(DEEP[..., :2]),
        deep_png(DEEP[..., :3], chunk(b"tRNS", struct.pack(">3H", *DEEP[3, 3, :3]))),
        tiff(DEEP, photometric="rgb", extrasamples=["unassalpha"]),
    ],
)
def test_transparent_pixels_are_refused_or_their_colours_taken_when_asked(data: bytes) -> None:
    with pytest.raises(InputError, match="picture is transparent in places"):
        picture_of(data, "picture")
    assert picture_of(data, "picture", ignore_alpha=True).shape[:2] == RGB.shape[:2]


@pytest.mark.parametrize("mode", ["CMYK", "LAB", "YCbCr", "HSV", "I"])
def test_modes_that_are_no_grey_and_no_rgb_are_named(mode: str) -> None:
    image = Image.fromarray(GREY).convert("I") if mode == "I" else None
    image = image or Image.fromarray(RGB).convert(mode)
    with pytest.raises(InputError, match=r"picture has .*: save it as PNG or TIFF"):
        decoded(image, "picture")
    if mode not in {"HSV", "I"}:
        with pytest.raises(InputError, match=r"picture has .*: save it as PNG or TIFF"):
            picture_of(saved(image, "TIFF"), "picture")


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("gamma", [b"", chunk(b"gAMA", struct.pack(">I", 100_000))])
def test_png_keeps_all_16_bits_whatever_its_gamma(channels: int, gamma: bytes) -> None:
    pixels = DEEP[..., :channels]
    expected = pixels if channels == 3 else pixels[..., 0]
    check(deep_png(pixels, gamma), expected)
    opaque = np.dstack([pixels, np.full(GREY.shape, 65_535, np.uint16)])
    check(deep_png(opaque, gamma), expected)


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float16, np.float32, np.float64])
def test_tiff_in_every_order(kind: Any) -> None:
    whole = kind in {np.uint8, np.uint16}
    pixels = DEEP[..., :3].astype(kind) if whole else (DEEP[..., :3] / 65_535).astype(kind)
    planes, packing = ("contig", "separate"), (None, "lzw", "zlib", "packbits", "zstd")
    for planar, order, compression in product(planes, "<>", packing):
        stored = pixels if planar == "contig" else np.moveaxis(pixels, 2, 0).copy()
        layout = {"byteorder": order, "compression": compression, "planarconfig": planar}
        data = tiff(stored, photometric="rgb", **layout)
        check(data, pixels if whole else pixels.astype(np.float32))


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("bits", [2, 4, 10, 12, 14])
def test_tiff_of_other_bits_fills_the_scale(order: str, bits: int) -> None:
    values = RANDOM.integers(0, 2**bits, (5, 7))
    values[0, :2] = 0, 2**bits - 1
    full, kind = (255, np.uint8) if bits < 8 else (65_535, np.uint16)
    check(packed_tiff(values, bits, order), np.rint(values * full / (2**bits - 1)).astype(kind))


def test_tiff_where_white_is_zero() -> None:
    check(tiff(GREY, photometric="miniswhite"), 255 - GREY)
    check(tiff(DEEP[..., 0], photometric="miniswhite"), 65_535 - DEEP[..., 0])
    check(tiff(GREY > 99, photometric="miniswhite"), np.where(GREY > 99, 0, 255).astype(np.uint8))


@pytest.mark.parametrize(("spread", "kind"), [(257, np.uint8), (256, np.uint8), (201, np.uint16)])
def test_palettes_of_tiff_have_16_bits(spread: int, kind: Any) -> None:
    colours = RANDOM.permutation(256).reshape(1, -1).repeat(3, axis=0).astype(np.uint16)
    data = tiff(GREY, photometric="palette", colormap=colours * np.uint16(spread))
    expected = colours * (spread if kind == np.uint16 else 1)
    check(data, np.moveaxis(expected[:, GREY], 0, 2).astype(kind))


@pytest.mark.parametrize(
    ("data", "wrong"),
    [
        (tiff(GREY.astype(np.uint32)), "numbers of 32 bits"),
        (tiff(GREY.astype(np.int16)), "signed numbers of 16 bits"),
        (tiff(RGB, photometric="cielab"), "pixels of kind CIELAB"),
        (tiff(GREY, compression="jpeg"), "compressed as JPEG"),
        (tiff(GREY, photometric="cfa"), "pixels of kind CFA"),
        (tiff(RGB, photometric="rgb", compression="jpeg"), "pixels of kind YCBCR"),
        (tiff(np.stack([GREY] * 3), imagej=True), "has 3 pictures in it"),
        (tiff(GREY / np.float32(2) - 9), "values that are no light"),
        (tiff(np.where(GREY > 99, np.nan, 1).astype(np.float32)), "values that are no light"),
        (saved(IMAGE, "PNG", save_all=True, append_images=[IMAGE.rotate(180)]), "has 2 pictures"),
        (saved(IMAGE, "JPEG2000"), "is no TIFF, PNG, JPEG"),
        (b"", "is no TIFF, PNG, JPEG"),
    ],
)
def test_what_is_refused_says_why(data: bytes, wrong: str) -> None:
    with pytest.raises(InputError, match=rf"picture .*{wrong}"):
        picture_of(data, "picture")


@pytest.mark.parametrize(
    "data",
    [
        *(saved(IMAGE, kind) for kind in ("JPEG", "PNG", "BMP", "WEBP")),
        saved(IMAGE, "JPEG", progressive=True),
        deep_png(DEEP[..., :3]),
        tiff(DEEP[..., :3], photometric="rgb"),
        tiff(DEEP[..., :3], photometric="rgb", compression="zlib"),
    ],
)
def test_no_part_of_a_picture_is_taken_for_it(data: bytes) -> None:
    picture_of(data, "picture")
    ends = (len(data) * np.array([0.3, 0.6, 0.9])).astype(int)
    filled = [data[:end] + bytes(len(data) - end) for end in ends if data[:2] == b"\xff\xd8"]
    for cut in [data[:end] for end in ends] + filled:
        with pytest.raises(InputError, match=r"picture is (damaged or cut short|no TIFF)"):
            picture_of(cut, "picture")


def test_a_bomb_is_refused() -> None:
    data = deep_png(DEEP[..., :1])
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", 60_000, 60_000, 16, 0, 0, 0, 0))
    with pytest.raises(InputError, match="damaged or cut short"):
        picture_of(data[:8] + head + data[33:], "picture")
    large = packed_tiff(np.zeros((2, 3), dtype=int), 8, "<")
    width, wide = (struct.pack("<HHII", 256, 4, 1, width) for width in (3, 2**30))
    with pytest.raises(InputError, match="says that it has 1073741824 x 2 pixels"):
        picture_of(large.replace(width, wide), "picture")


def test_orientation_and_profile_leave_the_numbers_alone() -> None:
    tags = Image.Exif()
    tags[0x0112] = 6  # turn by 90 degrees
    image = Image.fromarray(RGB)
    check(saved(image, "PNG", exif=tags, icc_profile=b"as of another screen"), RGB)


def test_hidden_files_are_no_photographs(tmp_path: Path) -> None:
    for name in ("b.JPG", "a.png", "._a.png", ".c.tif", "d.txt", "e.NEF"):
        (tmp_path / name).write_bytes(b"")
    assert [file.name for file in visible_files(tmp_path)] == ["a.png", "b.JPG", "e.NEF"]
    with pytest.raises(InputError, match="No such file"):
        read_picture(tmp_path / "none.png")


def mosaic(red: int = RED, green: int = GREEN, blue: int = BLUE) -> np.ndarray:
    return np.tile(np.array([[red, green], [green, blue]], dtype=np.uint16), (32, 48))


def share(value: float) -> float:
    return float(np.clip((value - BLACK) / (WHITE - BLACK), 0, 1) * 65_535)


@pytest.mark.parametrize("orientation", [1, 3, 6])
def test_levels_without_white_balance_or_turn(orientation: int) -> None:
    data = dng(mosaic(), BLACK, WHITE, orientation, as_shot=(0.5, 1, 0.7))
    found = picture_of(data, "IMG_1.DNG")
    assert (found.shape, found.dtype) == ((64, 96, 3), np.uint16)
    assert np.abs(found - [share(value) for value in (RED, GREEN, BLUE)]).max() <= 1
    facts = image_facts(data, ".dng")
    assert (facts.size_px, facts.model) == ((96, 64), "Maker Model")


def test_no_brightness_follows_what_is_photographed() -> None:
    dark = mosaic(600, 600, 600)
    dark[20, 30] = 2_000
    found = picture_of(dng(dark, BLACK, WHITE), "dark.dng")
    assert found[20, 30, 0] == pytest.approx(share(2_000), abs=1)
    assert found[40, 60] == pytest.approx([share(600)] * 3, abs=1)


def test_a_ramp_stays_in_its_place() -> None:
    """Linear interpolation of the mosaic is exact on it, within the rounding of neighbours."""
    x, y = np.meshgrid(np.arange(96), np.arange(64))
    ramp = BLACK + 10 * x + 20 * y
    found = picture_of(dng(ramp.astype(np.uint16), BLACK, WHITE), "ramp.dng")
    expected = (ramp - BLACK) * 65_535 / (WHITE - BLACK)
    assert np.abs(found - expected[..., None])[2:-2, 2:-2].max() < 2


@pytest.mark.parametrize("end", [0, 500, 2_000, -100])
def test_cut_files_are_refused(end: int) -> None:
    with pytest.raises(InputError, match=r"cut\.nef is damaged, or of a camera"):
        picture_of(dng(mosaic(), BLACK, WHITE)[:end], "cut.nef")


def test_without_the_library_the_way_to_it_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.nef").write_bytes(dng(mosaic()))
    monkeypatch.setitem(sys.modules, "rawpy", None)
    with pytest.raises(InputError, match=r"read by rawpy.*pip install 'tbcad\[machine\]'"):
        read_picture(tmp_path / "a.nef")
