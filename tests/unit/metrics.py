"""The metrics against direct, non-separable sums written from the papers: metrics.py DUMP_PROGRAM"""
import math
import random
import subprocess
import sys


def rmse(a, b):
    return math.sqrt(sum((x - y) ** 2 for p, q in zip(a, b) for x, y in zip(p, q)) / (3 * len(a)))


def ssim(a, b, width, height):
    ya, yb = ([0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2] for p in image] for image in (a, b))
    values, contrasts, whole = [], [], []
    for y in range(height):
        for x in range(width):
            weights, at = [], []
            for j in range(max(0, y - 5), min(height, y + 6)):
                for i in range(max(0, x - 5), min(width, x + 6)):
                    weights.append(math.exp(-((i - x) ** 2 + (j - y) ** 2) / 4.5))
                    at.append(j * width + i)
            total = sum(weights)
            ma = sum(w * ya[k] for w, k in zip(weights, at)) / total
            mb = sum(w * yb[k] for w, k in zip(weights, at)) / total
            va = sum(w * (ya[k] - ma) ** 2 for w, k in zip(weights, at)) / total
            vb = sum(w * (yb[k] - mb) ** 2 for w, k in zip(weights, at)) / total
            cov = sum(w * (ya[k] - ma) * (yb[k] - mb) for w, k in zip(weights, at)) / total
            values.append((2 * ma * mb + 1e-4) * (2 * cov + 9e-4)
                          / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4)))
            contrasts.append((2 * math.sqrt(va * vb) + 9e-4) / (va + vb + 9e-4))
            if len(at) == 121:
                whole.append(len(values) - 1)
    kept = whole or range(len(values))
    return (sum(values[i] for i in kept) / len(kept), values,
            sum(contrasts[i] for i in kept) / len(kept))


# IEC 61966-2-1 gives this matrix to four digits; here from the primaries, by Cramer's rule.
def rgb_to_xyz():
    xy = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
    columns = [(x / y, 1.0, (1 - x - y) / y) for x, y in xy]
    white = (0.3127 / 0.3290, 1.0, (1 - 0.3127 - 0.3290) / 0.3290)

    def determinant(c):
        return (c[0][0] * (c[1][1] * c[2][2] - c[1][2] * c[2][1])
                - c[1][0] * (c[0][1] * c[2][2] - c[0][2] * c[2][1])
                + c[2][0] * (c[0][1] * c[1][2] - c[0][2] * c[1][1]))
    scale = [determinant([white if j == i else columns[j] for j in range(3)])
             / determinant(columns) for i in range(3)]
    return [[columns[j][i] * scale[j] for j in range(3)] for i in range(3)], white


MATRIX, WHITE = rgb_to_xyz()
assert all(abs(a - b) < 1e-4 for a, b in zip(
    sum(MATRIX, []),
    (0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505)))


def solve(matrix, v):
    """Gauss-Jordan without pivoting, enough for the colour matrix."""
    rows = [list(r) + [x] for r, x in zip(matrix, v)]
    for i in range(3):
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for j in range(3):
            if j != i:
                rows[j] = [x - rows[j][i] * y for x, y in zip(rows[j], rows[i])]
    return [r[3] for r in rows]


def decode(v):
    return v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4


def relative_xyz(rgb):
    return [sum(m * c for m, c in zip(row, rgb)) / w for row, w in zip(MATRIX, WHITE)]


def opponent(rgb):
    x, y, z = relative_xyz(rgb)
    return 116 * y - 16, 500 * (x - y), 200 * (y - z)


def hunt_lab(rgb):
    def f(t):
        return t ** (1 / 3) if t > (6 / 29) ** 3 else t / (3 * (6 / 29) ** 2) + 4 / 29
    x, y, z = (f(t) for t in relative_xyz(rgb))
    light = 116 * y - 16
    return light, 0.01 * light * 500 * (x - y), 0.01 * light * 200 * (y - z)


def convolve(plane, width, height, kernel, radius):
    out = []
    for y in range(height):
        rows = [min(max(y + j, 0), height - 1) * width for j in range(-radius, radius + 1)]
        for x in range(width):
            columns = [min(max(x + i, 0), width - 1) for i in range(-radius, radius + 1)]
            out.append(sum(w * plane[r + c] for r, line in zip(rows, kernel)
                           for w, c in zip(line, columns)))
    return out


def kernel_of(radius, weight):
    return [[weight(x, y) for x in range(-radius, radius + 1)] for y in range(-radius, radius + 1)]


def look(image, width, height, ppd):
    planes = list(zip(*(opponent([decode(c) for c in p]) for p in image)))
    radius = math.ceil(3 * math.sqrt(0.04 / (2 * math.pi ** 2)) * ppd)
    eye = (((1, 0.0047), (0, 1e-5)), ((1, 0.0053), (0, 1e-5)), ((34.1, 0.04), (13.5, 0.025)))
    blurred = []
    for plane, parts in zip(planes, eye):
        kernel = kernel_of(radius, lambda x, y: sum(
            a * math.sqrt(math.pi / b) * math.exp(-math.pi ** 2 * (x * x + y * y) / ppd ** 2 / b)
            for a, b in parts))
        total = sum(map(sum, kernel))
        blurred.append([v / total for v in convolve(plane, width, height, kernel, radius)])
    labs = []
    for a, b, c in zip(*blurred):
        y = (a + 16) / 116
        xyz = [(y + b / 500) * WHITE[0], y * WHITE[1], (y - c / 200) * WHITE[2]]
        labs.append(hunt_lab([min(max(v, 0), 1) for v in solve(MATRIX, xyz)]))
    grey = [(v + 16) / 116 for v in planes[0]]
    sigma = 0.5 * 0.082 * ppd
    radius = math.ceil(3 * sigma)
    features = []
    for shape in (lambda x: -x, lambda x: x * x / sigma ** 2 - 1):
        across = kernel_of(radius, lambda x, y: shape(x) * math.exp(
            -(x * x + y * y) / (2 * sigma ** 2)))
        positive = sum(w for line in across for w in line if w > 0)
        negative = -sum(w for line in across for w in line if w < 0)
        across = [[w / (positive if w > 0 else negative) for w in line] for line in across]
        down = [list(line) for line in zip(*across)]
        features.append([math.hypot(p, q) for p, q in zip(
            convolve(grey, width, height, across, radius),
            convolve(grey, width, height, down, radius))])
    return labs, features


def hyab(a, b):
    return abs(a[0] - b[0]) + math.hypot(a[1] - b[1], a[2] - b[2])


def flip(a, b, width, height, ppd):
    labs_a, features_a = look(a, width, height, ppd)
    labs_b, features_b = look(b, width, height, ppd)
    most = hyab(hunt_lab((0, 1, 0)), hunt_lab((0, 0, 1))) ** 0.7
    values = []
    for i in range(width * height):
        colour = hyab(labs_a[i], labs_b[i]) ** 0.7
        if colour < 0.4 * most:
            colour *= 0.95 / (0.4 * most)
        else:
            colour = 0.95 + (colour - 0.4 * most) / (0.6 * most) * 0.05
        feature = max(abs(p[i] - q[i]) for p, q in zip(features_a, features_b))
        values.append(colour ** (1 - math.sqrt(feature / math.sqrt(2))))
    return sum(values) / len(values), values


def pictures():
    rng = random.Random(5)
    width, height = 23, 17

    def gradient(x, y):
        return [x / width, y / height, 0.5 + 0.5 * math.sin(0.7 * x)]
    base = [gradient(x, y) for y in range(height) for x in range(width)]
    noisy = [[min(1, max(0, c + rng.uniform(-0.2, 0.2))) for c in p] for p in base]
    # A soft edge against a hard one, as between two shadow methods.
    hard = [[0.8 if x > 11 else 0.1] * 3 for y in range(height) for x in range(width)]
    soft = [[min(0.8, max(0.1, 0.1 + 0.7 * (x - 8) / 7))] * 3
            for y in range(height) for x in range(width)]
    yield width, height, noisy, base, 67
    yield width, height, hard, soft, 67
    yield 9, 6, noisy[:54], base[:54], 30  # no whole window
    random_a = [[rng.random() for _ in range(3)] for _ in range(16 * 14)]
    random_b = [[rng.random() for _ in range(3)] for _ in range(16 * 14)]
    yield 16, 14, random_a, random_b, 40


# What scikit-image 0.19.3 gives for the luma of the same pictures: structural_similarity(...,
# gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1).
SCIKIT_IMAGE_SSIM = (0.5479127664, 0.5202049095, None, 0.0072954141)


def main():
    failures = 0
    for (width, height, a, b, ppd), known in zip(pictures(), SCIKIT_IMAGE_SSIM):
        values = [v for image in (a, b) for p in image for v in p]
        text = "%d %d\n" % (width, height) + " ".join("%.9g" % v for v in values)
        lines = subprocess.run([sys.argv[1], str(ppd)], input=text, text=True, check=True,
                               capture_output=True, timeout=60).stdout.splitlines()
        got = [[float(v) for v in line.split()] for line in lines]
        similarity, similarities, contrast = ssim(a, b, width, height)
        difference, differences = flip(a, b, width, height, ppd)
        wanted = [[rmse(a, b)], [similarity] + similarities, [contrast], [difference] + differences]
        for name, g, w in zip(("RMSE", "SSIM", "contrast", "FLIP"), got, wanted):
            worst = max(abs(x - y) for x, y in zip(g, w))
            print("%d x %d %s: %.6f, largest difference %.1e" % (width, height, name, w[0], worst))
            if len(g) != len(w) or not worst < 2e-6:
                failures += 1
        if known is not None and not abs(got[1][0] - known) < 1e-6:
            print("SSIM: %.9f instead of %.9f" % (got[1][0], known))
            failures += 1
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
