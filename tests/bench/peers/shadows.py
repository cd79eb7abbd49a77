"""Pictures as the race compares them: what is in shadow, and how far two are apart."""
import os
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../deploy"))
import contact_sheet  # noqa: E402  (its PNG reader)

LINEAR = [c / 255 / 12.92 if c <= 10 else ((c / 255 + 0.055) / 1.055) ** 2.4 for c in range(256)]
DARK = 0.02  # what is this dark without a shadow shows none


def read(png):
    """(width, height, rows of RGB bytes)"""
    with tempfile.NamedTemporaryFile(suffix=".png") as file:
        file.write(png)
        file.flush()
        return contact_sheet.read_png(file.name)


def greens(picture):
    """The green of every pixel, in linear light."""
    return [LINEAR[value] for row in picture[2] for value in row[1::3]]


def visible(shadowed, plain):
    """Light that arrives over light without a shadow, per pixel; None where there is none."""
    return [min(1, a / b) if b > DARK else None
            for a, b in zip(greens(read(shadowed)), greens(read(plain)))]


def darkness(fractions):
    """What counts as in shadow: below half way between its darkest thousandths and the light. Not
    everybody's shadows are black."""
    known = sorted(value for value in fractions if value is not None)
    return (1 + known[len(known) * 3 // 1000]) / 2 if known else 0


def agreement(a, b):
    """Of the pixels that are in shadow in one of two such lists, how many are in both."""
    dark_a, dark_b = darkness(a), darkness(b)
    either = both = 0
    for p, q in zip(a, b):
        if p is None or q is None:
            continue
        either += p < dark_a or q < dark_b
        both += p < dark_a and q < dark_b
    return both / either if either else 0


def penumbra_box(fractions, width, margin=4):
    """The box around all pixels that are in part lit: left, top, right, bottom."""
    at = [i for i, value in enumerate(fractions) if value is not None and 0.03 < value < 0.97]
    if not at:
        return 0, 0, width, len(fractions) // width
    columns, rows = [i % width for i in at], [i // width for i in at]
    return (max(0, min(columns) - margin), max(0, min(rows) - margin),
            min(width, max(columns) + margin + 1),
            min(len(fractions) // width, max(rows) + margin + 1))


def error(a, b, box):
    """Root mean square of the difference of two PNGs' values in [0, 1] within a box."""
    left, top, right, bottom = box
    (_, _, one), (_, _, other) = read(a), read(b)
    total = count = 0
    for p, q in zip(one[top:bottom], other[top:bottom]):
        p, q = p[3 * left:3 * right], q[3 * left:3 * right]
        total += sum((x - y) ** 2 for x, y in zip(p, q))
        count += len(p)
    return (total / count) ** 0.5 / 255
