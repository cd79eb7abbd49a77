"""The contact sheet: every PNG filter is undone, blocks are averaged, cells land where they belong."""
import os
import random
import struct
import subprocess
import sys
import tempfile
import zlib

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
sys.path.insert(0, os.path.join(ROOT, "deploy"))
import contact_sheet  # noqa: E402


def filtered_png(width, height, channels, pixels):
    """A PNG whose rows use filters 0 to 4 in turn, straight from the specification's formulas."""
    step, raw, above = width * channels, b"", bytes(width * channels)
    for y in range(height):
        row, kind = pixels[y * step:(y + 1) * step], y % 5
        out = bytearray()
        for i, value in enumerate(row):
            a = row[i - channels] if i >= channels else 0
            b = above[i]
            c = above[i - channels] if i >= channels else 0
            p = a + b - c
            pa, pb, pc = abs(p - a), abs(p - b), abs(p - c)
            paeth = a if pa <= pb and pa <= pc else b if pb <= pc else c
            out.append((value - (0, a, b, (a + b) // 2, paeth)[kind]) & 255)
        raw += bytes([kind]) + bytes(out)
        above = row

    def chunk(name, content):
        return struct.pack(">I", len(content)) + name + content + struct.pack(
            ">I", zlib.crc32(name + content))
    header = struct.pack(">IIBBBBB", width, height, 8, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(raw)) +
            chunk(b"IEND", b""))


def main():
    generator = random.Random(1)
    width, height = 12, 10
    with tempfile.TemporaryDirectory() as folder:
        arguments, expected = [], []
        for channels in (1, 3, 4):
            pixels = generator.randbytes(width * height * channels)
            path = os.path.join(folder, "%d.png" % channels)
            with open(path, "wb") as file:
                file.write(filtered_png(width, height, channels, pixels))
            rgb = b"".join(pixels[i:i + 3] if channels > 1 else pixels[i:i + 1] * 3
                           for i in range(0, len(pixels), channels))
            got = contact_sheet.read_png(path)
            assert got[:2] == (width, height) and b"".join(got[2]) == rgb, channels
            arguments.append("c%d=%s" % (channels, path))
            expected.append(rgb)
        sheet = os.path.join(folder, "sheet.png")
        subprocess.run([sys.executable, os.path.join(ROOT, "deploy", "contact_sheet.py"), "-o", sheet,
                        "--shrink", "2", "--columns", "2"] + arguments, check=True, timeout=60)
        sheet_width, _, rows = contact_sheet.read_png(sheet)
        margin, label = contact_sheet.MARGIN, contact_sheet.LABEL
        assert sheet_width == 2 * (width // 2 + margin) + margin
        for number, rgb in enumerate(expected):
            left = margin + number % 2 * (width // 2 + margin)
            top = margin + label + number // 2 * (height // 2 + label + margin)
            for y in range(height // 2):
                for x in range(width // 2):
                    for c in range(3):
                        block = [rgb[((2 * y + j) * width + 2 * x + i) * 3 + c]
                                 for j in (0, 1) for i in (0, 1)]
                        assert rows[top + y][(left + x) * 3 + c] == (sum(block) + 2) // 4
    print("ok")


if __name__ == "__main__":
    main()
