#!/usr/bin/env python3
"""Puts 8-bit PNGs of one size on one labelled sheet. Standard library only.

contact_sheet.py [--columns N] [--shrink N] -o sheet.png label=image.png ...
"""
import argparse
import itertools
import struct
import sys
import zlib

# 5 x 7 letters, a row per number, the highest bit of five on the left.
FONT = {
    "a": (14, 17, 17, 31, 17, 17, 17), "b": (30, 17, 17, 30, 17, 17, 30),
    "c": (14, 17, 16, 16, 16, 17, 14), "d": (30, 17, 17, 17, 17, 17, 30),
    "e": (31, 16, 16, 30, 16, 16, 31), "f": (31, 16, 16, 30, 16, 16, 16),
    "g": (14, 17, 16, 23, 17, 17, 15), "h": (17, 17, 17, 31, 17, 17, 17),
    "i": (14, 4, 4, 4, 4, 4, 14), "j": (7, 2, 2, 2, 2, 18, 12),
    "k": (17, 18, 20, 24, 20, 18, 17), "l": (16, 16, 16, 16, 16, 16, 31),
    "m": (17, 27, 21, 21, 17, 17, 17), "n": (17, 25, 21, 19, 17, 17, 17),
    "o": (14, 17, 17, 17, 17, 17, 14), "p": (30, 17, 17, 30, 16, 16, 16),
    "q": (14, 17, 17, 17, 21, 18, 13), "r": (30, 17, 17, 30, 20, 18, 17),
    "s": (15, 16, 16, 14, 1, 1, 30), "t": (31, 4, 4, 4, 4, 4, 4),
    "u": (17, 17, 17, 17, 17, 17, 14), "v": (17, 17, 17, 17, 17, 10, 4),
    "w": (17, 17, 17, 21, 21, 27, 17), "x": (17, 17, 10, 4, 10, 17, 17),
    "y": (17, 17, 10, 4, 4, 4, 4), "z": (31, 1, 2, 4, 8, 16, 31),
    "0": (14, 17, 19, 21, 25, 17, 14), "1": (4, 12, 4, 4, 4, 4, 14),
    "2": (14, 17, 1, 6, 8, 16, 31), "3": (14, 17, 1, 6, 1, 17, 14),
    "4": (2, 6, 10, 18, 31, 2, 2), "5": (31, 16, 30, 1, 1, 17, 14),
    "6": (14, 16, 30, 17, 17, 17, 14), "7": (31, 1, 2, 4, 4, 4, 4),
    "8": (14, 17, 17, 14, 17, 17, 14), "9": (14, 17, 17, 17, 15, 1, 14),
    "-": (0, 0, 0, 31, 0, 0, 0), "_": (0, 0, 0, 0, 0, 0, 31), ".": (0, 0, 0, 0, 0, 12, 12),
    "=": (0, 0, 31, 0, 31, 0, 0), "(": (2, 4, 8, 8, 8, 4, 2), ")": (8, 4, 2, 2, 2, 4, 8),
    " ": (0,) * 7,
}
SCALE, MARGIN, LABEL = 2, 8, 24  # px
BACKGROUND, INK = 24, 230


def unfilter(kind, row, above, bpp):
    """One row without its PNG filter."""
    if kind == 0:
        return bytes(row)
    out = bytearray(len(row))
    if kind == 1:
        for channel in range(bpp):
            out[channel::bpp] = bytes(v & 255 for v in itertools.accumulate(row[channel::bpp]))
        return bytes(out)
    for i, value in enumerate(row):
        left, up, corner = (out[i - bpp], above[i], above[i - bpp]) if i >= bpp else (0, above[i], 0)
        if kind == 2:
            guess = up
        elif kind == 3:
            guess = (left + up) // 2
        else:
            estimate = left + up - corner
            guess = min((left, up, corner), key=lambda n: abs(estimate - n))
        out[i] = (value + guess) & 255
    return bytes(out)


def read_png(path):
    """(width, height, rows of RGB bytes)"""
    with open(path, "rb") as file:
        data = file.read()
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        sys.exit("%s is not a PNG" % path)
    at, body = 8, b""
    while at < len(data):
        size, = struct.unpack_from(">I", data, at)
        kind, content = data[at + 4:at + 8], data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, bits, colour, _, _, interlace = struct.unpack(">IIBBBBB", content)
        elif kind == b"IDAT":
            body += content
        at += 12 + size
    if bits != 8 or colour not in (0, 2, 6) or interlace:
        sys.exit("%s: only plain 8-bit grey, RGB and RGBA" % path)
    bpp = {0: 1, 2: 3, 6: 4}[colour]
    raw, step = zlib.decompress(body), width * bpp + 1
    rows, above = [], bytes(width * bpp)
    for y in range(height):
        above = unfilter(raw[y * step], raw[y * step + 1:(y + 1) * step], above, bpp)
        rgb = above
        if bpp != 3:
            rgb = bytearray(width * 3)
            for channel in range(3):
                rgb[channel::3] = above[channel if bpp == 4 else 0::bpp]
        rows.append(bytes(rgb))
    return width, height, rows


def shrink(width, height, rows, by):
    """Averages blocks of by x by pixels."""
    if by == 1:
        return width, height, rows
    small_width, small_height, area = width // by, height // by, by * by
    out = []
    for y in range(small_height):
        line = bytearray(small_width * 3)
        for channel in range(3):
            columns = [row[channel + 3 * i::3 * by][:small_width]
                       for row in rows[y * by:(y + 1) * by] for i in range(by)]
            line[channel::3] = bytes((sum(c) + area // 2) // area for c in zip(*columns))
        out.append(bytes(line))
    return small_width, small_height, out


def draw_label(sheet, sheet_width, x, y, text):
    for number, letter in enumerate(text.lower()):
        for dy, bits in enumerate(FONT.get(letter, FONT["-"])):
            for dx in range(5):
                if not bits >> (4 - dx) & 1:
                    continue
                for i in range(SCALE):
                    at = ((y + dy * SCALE + i) * sheet_width + x + (number * 6 + dx) * SCALE) * 3
                    sheet[at:at + 3 * SCALE] = bytes([INK]) * (3 * SCALE)


def write_png(path, width, height, pixels):
    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(
            ">I", zlib.crc32(kind + content))
    step = width * 3
    raw = b"".join(b"\0" + pixels[y * step:(y + 1) * step] for y in range(height))
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" +
                   chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
                   chunk(b"IDAT", zlib.compress(raw, 6)) + chunk(b"IEND", b""))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--columns", type=int, default=4)
    parser.add_argument("--shrink", type=int, default=2)
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("images", nargs="+", metavar="label=image.png")
    options = parser.parse_args()
    cells = []
    for argument in options.images:
        label, _, path = argument.rpartition("=")
        cells.append((label or path, shrink(*read_png(path), options.shrink)))
    cell_width = max(cell[1][0] for cell in cells) + MARGIN
    cell_height = max(cell[1][1] for cell in cells) + LABEL + MARGIN
    columns = min(options.columns, len(cells))
    width = columns * cell_width + MARGIN
    height = -(-len(cells) // columns) * cell_height + MARGIN
    sheet = bytearray([BACKGROUND]) * (width * height * 3)
    for number, (label, (image_width, _, rows)) in enumerate(cells):
        x = MARGIN + number % columns * cell_width
        y = MARGIN + number // columns * cell_height
        draw_label(sheet, width, x, y + 4, label[:(cell_width - MARGIN) // (6 * SCALE)])
        for dy, row in enumerate(rows):
            at = ((y + LABEL + dy) * width + x) * 3
            sheet[at:at + 3 * image_width] = row
    write_png(options.output, width, height, bytes(sheet))


if __name__ == "__main__":
    main()
