"""Plots as SVG text: a scatter on two logarithmic axes, and values against the range they should
have. Colours are left to the page's style sheet."""
import math
from html import escape

WIDTH, HEIGHT = 960, 560
LEFT, RIGHT, TOP, BOTTOM = 64, 110, 16, 48
DOT = 5  # px, radius that labels keep clear of
LABEL = 12  # px, height of a label


def decades(low, high):
    """1, 2 and 5 times powers of ten that cover [low, high]."""
    ticks = []
    for exponent in range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1):
        ticks += [factor * 10.0 ** exponent for factor in (1, 2, 5)]
    first = max((tick for tick in ticks if tick <= low), default=ticks[0])
    last = min((tick for tick in ticks if tick >= high), default=ticks[-1])
    return [tick for tick in ticks if first <= tick <= last]


def covers(a, b):
    """Whether two boxes (left, top, right, bottom) overlap."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def label_spots(x, y, width):
    """Boxes for a label of a point, the best first: beside it, above and below, then farther off."""
    for distance in range(0, 12 * LABEL, LABEL // 2):
        for up in (0,) if not distance else (-distance, distance):
            reach = DOT + 3 + distance / 2
            for left in (x + reach, x - reach - width):
                yield left, y + up - LABEL / 2, left + width, y + up + LABEL / 2
        if distance:
            for up in (-distance - DOT, distance + DOT):
                yield x - width / 2, y + up - LABEL / 2, x + width / 2, y + up + LABEL / 2


def place_labels(points):
    """Labels near their points, so that none covers another or a point, as long as there is room:
    (x, y, box, text)."""
    taken = [(x - DOT, y - DOT, x + DOT, y + DOT) for x, y, _ in points]
    for x, y, text in sorted(points, key=lambda point: point[1]):
        spots = list(label_spots(x, y, 6.2 * len(text)))
        free = (box for box in spots if box[0] > LEFT and box[2] < WIDTH and box[1] > TOP and
                box[3] < HEIGHT - BOTTOM and not any(covers(box, other) for other in taken))
        box = next(free, spots[0])
        taken.append(box)
        yield x, y, box, text


def axes(xs, ys, x_title, y_title, kind):
    """Opens a plot on two logarithmic axes that show all values: (pieces of SVG, x_of, y_of)."""
    x_ticks, y_ticks = decades(min(xs), max(xs)), decades(min(ys), max(ys))

    def scale(value, ticks, low, high):
        if ticks[0] == ticks[-1]:
            return (low + high) / 2
        share = math.log(value / ticks[0]) / math.log(ticks[-1] / ticks[0])
        return low + share * (high - low)

    def x_of(value):
        return scale(value, x_ticks, LEFT, WIDTH - RIGHT)

    def y_of(value):
        return scale(value, y_ticks, HEIGHT - BOTTOM, TOP)

    out = ['<svg class="%s" viewBox="0 0 %d %d" role="img" aria-label="%s against %s">' % (
        kind, WIDTH, HEIGHT, escape(y_title, True), escape(x_title, True))]
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
    return out, x_of, y_of


def curves(lines, x_title, y_title):
    """lines: {name: [(x, y)]} by increasing x, all positive; the name stands at the last point."""
    every = [point for points in lines.values() for point in points]
    if not every:
        return ""
    out, x_of, y_of = axes([x for x, _ in every], [y for _, y in every], x_title, y_title, "curves")
    names = {}
    for name, points in lines.items():
        at = [(x_of(x), y_of(y)) for x, y in points]
        out.append('<path class="line" d="M%s"/>' % "L".join("%.1f %.1f" % p for p in at))
        names[at[-1] + (name,)] = name
    for x, y, (left, _, _, bottom), name in place_labels(list(names)):
        out.append('<circle cx="%.1f" cy="%.1f" r="2.5"/><text x="%.1f" y="%.1f">%s</text>' % (
            x, y, left, bottom - 2, escape(name)))
    return "".join(out) + "</svg>"


def scatter(points, x_title, y_title):
    """points: (x, y, label, kind), all positive; kind is a class of the style sheet."""
    if not points:
        return ""
    out, x_of, y_of = axes([p[0] for p in points], [p[1] for p in points], x_title, y_title,
                           "scatter")
    kinds = {(x_of(x), y_of(y), label): kind for x, y, label, kind in points}
    for x, y, (left, top, right, bottom), text in place_labels(list(kinds)):
        kind = kinds[(x, y, text)]
        out.append('<g class="%s"><circle cx="%.1f" cy="%.1f" r="4"/>' % (escape(kind, True), x, y))
        end_x, end_y = min(max(x, left), right), (top + bottom) / 2
        if math.hypot(end_x - x, end_y - y) > LABEL + DOT:
            out.append('<path class="lead" d="M%.1f %.1fL%.1f %.1f"/>' % (x, y, end_x, end_y))
        out.append('<text x="%.1f" y="%.1f">%s</text></g>' % (left, bottom - 2, escape(text)))
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
