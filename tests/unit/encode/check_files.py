"""Reads EXR, TIFF and PNG files written by encode_sample with readers of its own (from the format
specifications, standard library only) and compares every sample with what pattern.h says."""
import math
import os
import struct
import subprocess
import sys
import tempfile
import zlib


def bits_of(index):
    x = index * 2654435761 & 0xFFFFFFFF
    x ^= x >> 15
    x = x * 2246822519 & 0xFFFFFFFF
    return x ^ x >> 13


def as_float32(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


FLOAT_MAX = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]


def finite(value, limit):
    if math.isnan(value):
        return 0.0
    return max(-limit, min(limit, value))


def source(index, pixel, any_bits):
    """The value that pattern_plane stored at `index`."""
    bits = bits_of(index)
    if pixel == 8:
        return (bits & 255) / 255
    if pixel == 16:
        return struct.unpack("<e", struct.pack("<H", bits & 0xFFFF))[0]
    if any_bits:
        return struct.unpack("<f", struct.pack("<I", bits))[0]
    special = {5: math.nan, 6: math.inf, 7: -math.inf}.get(index % 97)
    return as_float32((bits & 0xFFFF) / 60000.0 - 0.05) if special is None else special


def read_exr(data):
    """{channel: (type, [samples])}, attributes. Single part, scan lines, ZIP or no compression."""
    magic, version = struct.unpack_from("<II", data)
    assert magic == 20000630 and version & 0xFF == 2 and not version >> 8 & ~4, (magic, version)
    at, attributes = 8, {}
    while data[at]:
        end = data.index(0, at)
        name, at = data[at:end].decode(), end + 1
        end = data.index(0, at)
        kind, at = data[at:end].decode(), end + 1
        size, = struct.unpack_from("<I", data, at)
        attributes[name] = (kind, data[at + 4:at + 4 + size])
        at += 4 + size
    at += 1
    channels, raw, i = [], attributes["channels"][1], 0
    while raw[i]:
        end = raw.index(0, i)
        kind, _, xs, ys = struct.unpack_from("<IIII", raw, end + 1)
        assert (xs, ys) == (1, 1)
        channels.append((raw[i:end].decode(), kind))
        i = end + 17
    assert channels == sorted(channels)
    x0, y0, x1, y1 = struct.unpack("<iiii", attributes["dataWindow"][1])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    compression = attributes["compression"][1][0]
    rows_per_chunk = {0: 1, 2: 1, 3: 16}[compression]
    chunks = -(-height // rows_per_chunk)
    offsets = struct.unpack_from("<%dQ" % chunks, data, at)
    planes = {name: (kind, []) for name, kind in channels}
    row_bytes = sum(width * (2 if kind == 1 else 4) for _, kind in channels)
    for offset in offsets:
        y, size = struct.unpack_from("<ii", data, offset)
        rows = min(rows_per_chunk, height - (y - y0))
        raw = data[offset + 8:offset + 8 + size]
        if size != rows * row_bytes:
            delta = bytearray(zlib.decompress(raw))
            for i in range(1, len(delta)):
                delta[i] = (delta[i - 1] + delta[i] - 128) & 255
            half = (len(delta) + 1) // 2
            raw = bytearray(len(delta))
            raw[0::2], raw[1::2] = delta[:half], delta[half:]
        assert len(raw) == rows * row_bytes
        i = 0
        for _ in range(rows):
            for name, kind in channels:
                code, step = ("e", 2) if kind == 1 else ("f", 4)
                planes[name][1].extend(struct.unpack_from("<%d%s" % (width, code), raw, i))
                i += width * step
    return width, height, planes, attributes


def read_tiff(data):
    """(width, height, channels, bits, samples, tags): strips, deflate or none, predictor 1 or 2."""
    order = {b"II": "<", b"MM": ">"}[data[:2]]
    assert struct.unpack_from(order + "H", data, 2)[0] == 42
    ifd, = struct.unpack_from(order + "I", data, 4)
    tags = {}
    for i in range(struct.unpack_from(order + "H", data, ifd)[0]):
        tag, kind, count = struct.unpack_from(order + "HHI", data, ifd + 2 + 12 * i)
        code, step = {1: ("B", 1), 2: ("s", 1), 3: ("H", 2), 4: ("I", 4)}.get(kind, ("", 0))
        if not step:
            continue
        at = ifd + 10 + 12 * i
        if count * step > 4:
            at, = struct.unpack_from(order + "I", data, at)
        values = struct.unpack_from("%s%d%s" % (order, count, code), data, at)
        tags[tag] = values[0] if code == "s" else values
    width, height, channels = tags[256][0], tags[257][0], tags.get(277, (1,))[0]
    bits, compression, predictor = tags[258][0], tags[259][0], tags.get(317, (1,))[0]
    assert tags.get(284, (1,))[0] == 1
    raw = b""
    for offset, size in zip(tags[273], tags[279]):
        strip = data[offset:offset + size]
        raw += strip if compression == 1 else zlib.decompress(strip)
    count = width * height * channels
    samples = list(struct.unpack("%s%d%s" % (order, count, "B" if bits == 8 else "H"), raw))
    if predictor == 2:
        for y in range(height):
            row = y * width * channels
            for i in range(row + channels, row + width * channels):
                samples[i] = (samples[i] + samples[i - channels]) & ((1 << bits) - 1)
    return width, height, channels, bits, samples, tags


def read_png(data):
    """(width, height, channels, bits, samples, (texts, colour chunks)); filters 0 and 1 only."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, body, texts, colours, kinds = 8, b"", {}, {}, []
    while at < len(data):
        size, = struct.unpack_from(">I", data, at)
        kind, content = data[at + 4:at + 8], data[at + 8:at + 8 + size]
        assert struct.unpack_from(">I", data, at + 8 + size)[0] == zlib.crc32(kind + content)
        kinds.append(kind)
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack_from(">IIBB", content)
            assert content[10:] == b"\0\0\0"
        elif kind == b"IDAT":
            body += content
        elif kind == b"tEXt":
            key, text = content.split(b"\0", 1)
            texts[key.decode("latin-1")] = text.decode("latin-1")
        elif kind in (b"sRGB", b"gAMA", b"cHRM", b"cICP", b"iCCP"):
            assert b"IDAT" not in kinds
            colours[kind] = content
        at += 12 + size
    assert kinds[0] == b"IHDR" and kinds[-1] == b"IEND" and at == len(data)
    raw = zlib.decompress(body)  # checks the Adler-32 too
    channels = {0: 1, 2: 3, 6: 4}[colour]
    bpp = channels * bits // 8
    step, samples = width * bpp + 1, []
    assert len(raw) == step * height
    for y in range(height):
        row = bytearray(raw[y * step + 1:(y + 1) * step])
        if raw[y * step] == 1:
            for i in range(bpp, len(row)):
                row[i] = (row[i] + row[i - bpp]) & 255
        samples.extend(struct.unpack(">%d%s" % (width * channels, "B" if bits == 8 else "H"), row))
    return width, height, channels, bits, samples, (texts, colours)


def encode(tool, *args):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "image")
        subprocess.run([tool, *map(str, args), path], check=True, timeout=60)
        with open(path, "rb") as file:
            return file.read()


def check_integers(tool, kind, reader, bits, pixel, channels, width, height):
    data = encode(tool, kind, bits, pixel, channels, width, height, "beauty")
    w, h, c, b, samples, extra = reader(data)
    assert (w, h, c, b) == (width, height, channels, bits), (w, h, c, b)
    top = (1 << bits) - 1
    for i in range(width * height):
        for k in range(channels):
            want = finite(source(i * 4 + k, pixel, False), 1.0)
            want = math.floor(max(want, 0.0) * top + 0.5)
            got = samples[i * channels + k]
            assert got == want, (kind, bits, width, height, i, k, got, want)
    if kind == "png":
        texts, colours = extra
        assert texts == {"technique": "pcss", "title": 'a scene, with = and "quotes"'}, texts
        # PNG (third edition), table of what sRGB's chunk is accompanied by.
        assert colours == {b"sRGB": b"\0", b"gAMA": struct.pack(">I", 45455), b"cHRM": struct.pack(
            ">8I", 31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000)}, colours
    else:
        assert extra.get(338) == ((2,) if channels == 4 else None), extra  # unassociated alpha
        assert b"technique=pcss" in extra[270] and 306 not in extra, extra  # 306: the time
    print(kind, bits, "bit", channels, "channels", width, "x", height, len(data), "bytes: same")


def check_exr(tool, bits, pixel, channels, width, height, names):
    data = encode(tool, "exr", bits, pixel, channels, width, height, ",".join(names))
    w, h, planes, attributes = read_exr(data)
    assert (w, h) == (width, height)
    assert attributes["technique"] == ("string", b"pcss"), attributes
    assert attributes["title"][1] == b'a scene, with = and "quotes"'
    assert "capDate" not in attributes and "DateTime" not in attributes, attributes.keys()
    if "beauty" in names:  # BT.709, and white D65
        kind, raw = attributes["chromaticities"]
        xy = [0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329]
        assert kind == "chromaticities" and list(struct.unpack("<8f", raw)) == list(map(as_float32, xy))
    else:
        assert "chromaticities" not in attributes
    expected = {}
    for p, name in enumerate(names):
        count = channels if p == 0 else 1 if name == "depth" else 3
        kind = 32 if p and name in ("depth", "position") else pixel
        letters = "RGBA"
        if count == 1:
            letters = "Z" if name == "depth" else "Y"
        elif len(names) > 1 and name in ("normal", "position"):
            letters = "XYZ"
        for k in range(count):
            prefix = "" if len(names) == 1 or name == "beauty" else name + "."
            stored = bits or (32 if kind == 32 else 16)
            expected[prefix + letters[k]] = (k, kind, stored)
    assert set(planes) == set(expected), (set(planes), set(expected))
    for name, (k, kind, stored) in expected.items():
        assert planes[name][0] == (1 if stored == 16 else 2), (name, planes[name][0])
        for i, got in enumerate(planes[name][1]):
            want = source(i * 4 + k, kind, True)
            if stored == 16:
                want = struct.unpack("<e", struct.pack("<e", finite(want, 65504.0)))[0]
            else:
                want = finite(want, FLOAT_MAX)
            assert got == want, (name, i, got, want)
    print("exr", bits, "bit", names, width, "x", height, len(data), "bytes: same")


def main():
    tool = sys.argv[1]
    for bits, pixel in ((8, 8), (16, 32), (16, 16)):
        for channels in (1, 3, 4) if bits != pixel else (3,):
            for reader, kind in ((read_tiff, "tiff"), (read_png, "png")):
                check_integers(tool, kind, reader, bits, pixel, channels, 61, 37)
    assert not read_png(encode(tool, "png", 8, 8, 3, 9, 9, "normal"))[5][1]  # data has no colour
    for width, height in ((1, 1), (1, 8192), (8191, 3)):
        check_integers(tool, "tiff", read_tiff, 16, 32, 3, width, height)
        check_exr(tool, 16, 16, 3, width, height, ["beauty"])
    check_exr(tool, 0, 16, 4, 97, 53, ["beauty"])
    check_exr(tool, 32, 32, 3, 97, 53, ["beauty"])
    check_exr(tool, 32, 16, 3, 64, 16, ["beauty"])
    check_exr(tool, 16, 32, 3, 64, 17, ["beauty"])
    check_exr(tool, 0, 32, 1, 40, 40, ["depth"])
    check_exr(tool, 0, 16, 1, 40, 40, ["penumbra"])
    check_exr(tool, 0, 16, 4, 50, 70, ["beauty", "visibility", "depth", "normal", "position"])
    check_exr(tool, 16, 16, 4, 50, 70, ["beauty", "albedo", "depth", "position"])


if __name__ == "__main__":
    main()
