"""Plots as SVG text: a scatter on two logarithmic axes, and values against the range they should
have. Colours are left to the page's style sheet."""
import math
from html import escape

WIDTH, HEIGHT = 720, 440
LEFT, RIGHT, TOP, BOTTOM = 64, 130, 16, 48
LABEL = 12  # px, height of a label


def decades(low, high):
    """1, 2 and 5 times powers of ten that cover [low, high]."""
    ticks = []
    for exponent in range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1):
        ticks += [factor * 10.0 ** exponent for factor in (1, 2, 5)]
    first = max((tick for tick in ticks if tick <= low), default=ticks[0])
    last = min((tick for tick in ticks if tick >= high), default=ticks[-1])
    return [tick for tick in ticks if first <= tick <= last]


def place_labels(points):
    """Labels beside their points, pushed down until none covers another: (x, y, text)."""
    placed = []
    for x, y, text in sorted(points, key=lambda point: point[1]):
        width = 6.2 * len(text)
        at = y
        while any(abs(at - other_y) < LABEL and x + 8 < other_x + other_width and
                  other_x < x + 8 + width for other_x, other_y, other_width in placed):
            at += 2
        placed.append((x + 8, at, width))
        yield x, y, x + 8, at, text


def scatter(points, x_title, y_title):
    """points: (x, y, label, kind), all positive; kind is a class of the style sheet."""
    if not points:
        return ""
    x_ticks = decades(min(p[0] for p in points), max(p[0] for p in points))
    y_ticks = decades(min(p[1] for p in points), max(p[1] for p in points))

    def scale(value, ticks, low, high):
        if ticks[0] == ticks[-1]:
            return (low + high) / 2
        share = math.log(value / ticks[0]) / math.log(ticks[-1] / ticks[0])
        return low + share * (high - low)

    def x_of(value):
        return scale(value, x_ticks, LEFT, WIDTH - RIGHT)

    def y_of(value):
        return scale(value, y_ticks, HEIGHT - BOTTOM, TOP)

    out = ['<svg class="scatter" viewBox="0 0 %d %d" role="img" aria-label="%s against %s">' % (
        WIDTH, HEIGHT, escape(y_title, True), escape(x_title, True))]
    for tick in x_ticks:
        x = x_of(tick)
        out.append('<path class="grid" d="M%.1f %dV%d"/><text class="tick" x="%.1f" y="%d" '
                   'text-anchor="middle">%g</text>' % (x, TOP, HEIGHT - BOTTOM, x,
                                                       HEIGHT - BOTTOM + 16, tick))
    for tick in y_ticks:
        y = y_of(tick)
        out.append('<path class="grid" d="M%d %.1fH%d"/><text class="tick" x="%d" y="%.1f" '
                   'text-anchor="end">%g</text>' % (LEFT, y, WIDTH - RIGHT, LEFT - 6, y + 4, tick))
    out.append('<text class="axis" x="%d" y="%d" text-anchor="middle">%s</text>' % (
        (LEFT + WIDTH - RIGHT) / 2, HEIGHT - 10, escape(x_title)))
    out.append('<text class="axis" transform="translate(14 %d) rotate(-90)" text-anchor="middle">'
               '%s</text>' % ((TOP + HEIGHT - BOTTOM) / 2, escape(y_title)))
    kinds = {(x_of(x), y_of(y), label): kind for x, y, label, kind in points}
    for x, y, label_x, label_y, text in place_labels(list(kinds)):
        kind = kinds[(x, y, text)]
        out.append('<g class="%s"><circle cx="%.1f" cy="%.1f" r="4"/>' % (escape(kind, True), x, y))
        if label_y > y + 6:
            out.append('<path class="lead" d="M%.1f %.1fL%.1f %.1f"/>' % (x, y, label_x - 1,
                                                                         label_y))
        out.append('<text x="%.1f" y="%.1f">%s</text></g>' % (label_x, label_y + 4, escape(text)))
    return "".join(out) + "</svg>"


def strip(values, good, fair):
    """Medians with their quartiles (median, low, high, verdict) over the ranges that count as
    reproduced and as partly so; a linear axis that shows zero, one and every value."""
    width, row, pad = 220, 12, 8
    ends = [limit for limit in good + fair if abs(limit) != math.inf]
    ends += [value for entry in values for value in entry[:3]]
    low, high = min(ends), max(ends)
    margin = 0.08 * (high - low or abs(high) or 1)
    low, high = low - margin, high + margin

    def x_of(value):
        return pad + (min(max(value, low), high) - low) / (high - low) * (width - 2 * pad)

    height = row * len(values) + 18
    out = ['<svg class="strip" viewBox="0 0 %d %d" width="%d" height="%d" role="img" '
           'aria-label="values and limits">' % (width, height, width, height)]
    for limits, kind in ((fair, "fair"), (good, "good")):
        out.append('<rect class="%s" x="%.1f" y="0" width="%.1f" height="%d"/>' % (
            kind, x_of(limits[0]), max(0, x_of(limits[1]) - x_of(limits[0])), height - 14))
    for i, (median, first, third, verdict) in enumerate(values):
        y = row * i + row / 2 + 1
        out.append('<g class="%s"><path class="bar" d="M%.1f %.1fH%.1f"/>'
                   '<circle cx="%.1f" cy="%.1f" r="3.5"/></g>' % (
                       verdict, x_of(first), y, x_of(third), x_of(median), y))
    for value, anchor in ((low, "start"), (high, "end")):
        out.append('<text class="tick" x="%.1f" y="%d" text-anchor="%s">%.3g</text>' % (
            x_of(value), height - 2, anchor, value))
    return "".join(out) + "</svg>"
