"""What a file looks like when nothing but the file is given: light, exposure, framing, normals."""
import math
import random
import unittest

import harness
from harness import Daemon
from pictures import box, mesh_scene, off_by_more_than, png, pose_files, rgb

SIZE = {"width": 160, "height": 120}


def multiply(m, v):
    return [sum(m[r][c] * v[c] for c in range(3)) for r in range(3)]


def determinant(m):
    return sum(m[0][i] * (m[1][(i + 1) % 3] * m[2][(i + 2) % 3] -
                          m[1][(i + 2) % 3] * m[2][(i + 1) % 3]) for i in range(3))


def inverse_transpose(m):
    d = determinant(m)
    return [[(m[(r + 1) % 3][(c + 1) % 3] * m[(r + 2) % 3][(c + 2) % 3] -
              m[(r + 1) % 3][(c + 2) % 3] * m[(r + 2) % 3][(c + 1) % 3]) / d
             for c in range(3)] for r in range(3)]


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return [x / length for x in v]


def wedge():
    """A shape without any symmetry, normals that lean away from its facets', corners that floats hold
    exactly."""
    points, _, indices = box((1, 1.5, 0.75))
    points = [[x + 0.25 * y, y - 0.5 * x, z + 0.125 * y] for x, y, z in points]
    normals = []
    for first in range(0, len(points), 4):
        a, b, c = points[first:first + 3]
        u, v = ([q - p for p, q in zip(s, t)] for s, t in ((a, b), (b, c)))
        facet = unit([u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3]
                      for k in range(3)])
        normals += [unit([0.8 * n + 0.2 * p for n, p in zip(facet, unit(point))])
                    for point in points[first:first + 4]]
    return points, normals, indices


def random_matrix(rng):
    """Every number is a multiple of 1/64, so that floats hold what it makes of such numbers."""
    while True:
        m = [[rng.randint(-96, 96) / 64 for _ in range(3)] for _ in range(3)]
        if abs(determinant(m)) > 0.2:
            return m


def columns_of(m, move=(0, 0, 0)):
    return [m[r][c] if r < 3 else 0 for c in range(3) for r in range(4)] + list(move) + [1]


# Half a turn about the normal apart, so that one is what the other looks like from behind.
TILTS = ((208, 168, 218), (48, 88, 218))


def bent(points, normals, tangents, indices, tilt, uv=None, uv_set=0, transform=None, **node):
    """A shape in which a normal map of one colour bends every normal; the node may have instances.
    Every four points span the texture unless uv says otherwise."""
    b = pose_files.Builder()
    corners = ([0, 0], [1, 0], [1, 1], [0, 1])
    uv = uv or [corners[k % 4] for k in range(len(points))]
    b.json["images"] = [{"bufferView": b.view(png([[tilt]], 2, 8)), "mimeType": "image/png"}]
    b.json["textures"] = [{"source": 0}]
    b.json["materials"] = [{"doubleSided": True, "normalTexture": {"index": 0, "texCoord": uv_set}}]
    if transform:
        b.json["extensionsUsed"] = ["KHR_texture_transform"]
        b.json["materials"][0]["normalTexture"]["extensions"] = {"KHR_texture_transform": transform}
    attributes = {"POSITION": b.floats("VEC3", points), "NORMAL": b.floats("VEC3", normals),
                  "TEXCOORD_0": b.floats("VEC2", [[0, 0]] * len(uv) if uv_set else uv)}
    if uv_set:
        attributes["TEXCOORD_1"] = b.floats("VEC2", uv)
    if tangents:
        attributes["TANGENT"] = b.floats("VEC4", tangents)
    b.json["meshes"] = [{"primitives": [{
        "attributes": attributes, "material": 0,
        "indices": b.accessor("SCALAR", 5123, "H", [[i] for i in indices])}]}]
    if "instance" in node:
        b.json["extensionsUsed"] = ["EXT_mesh_gpu_instancing"]
        attributes = {k: b.floats("VEC4" if k == "ROTATION" else "VEC3", [v])
                      for k, v in node.pop("instance").items()}
        node["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    b.node(True, mesh=0, **node)
    return b.glb()


def knot(rings=20, sides=8):
    """A closed tube around the origin with smooth normals that lean, uneven triangles and a texture
    that is wound around it, mirrored in one half; vertices at multiples of 1/256."""
    points, normals, uv, indices = [], [], [], []
    for i in range(rings + 1):
        a = 2 * math.pi * (i % rings) / rings
        for k in range(sides + 1):
            c = 2 * math.pi * (k % sides) / sides + 0.4 * math.sin(a)
            tube = [math.cos(a) * math.cos(c), math.sin(c) + 0.4 * math.sin(2 * a),
                    math.sin(a) * math.cos(c)]
            points.append([round(256 * (b * r + 0.45 * t)) / 256 for b, r, t in zip(
                (math.cos(a), math.sin(2 * a), math.sin(a)), (1, 0.3, 1), tube)])
            normals.append(unit(tube))
            uv.append([3 * abs(i - rings / 2) / rings + 0.2 * k / sides, k / sides])
    for i in range(rings):
        for k in range(sides):
            a, b = i * (sides + 1) + k, (i + 1) * (sides + 1) + k
            indices += [a, a + 1, b, b, a + 1, b + 1]
    return points, normals, uv, indices


class FirstSight(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()

    @classmethod
    def tearDownClass(cls):
        assert cls.d.stop() == 0

    def picture(self, scene, **request):
        answer = self.d.render(scene, {**SIZE, **request}, timeout=300)
        self.assertEqual(answer.status, 200, answer.body[:300])
        return rgb(answer)

    def test_node_transform_is_the_baked_one(self):
        """Rotation, shear, uneven scale, mirrors. Every number is a multiple of 1/64, so that both files
        have the same vertices to the last bit."""
        points, normals, indices = wedge()
        rng = random.Random(7)
        request = {**SIZE, "width": 96, "height": 72, "technique": {"name": "raytraced"}}
        mirrors = 0
        for n in range(50):
            m = random_matrix(rng)
            move = [rng.randint(-64, 64) / 64 for _ in range(3)]
            turned = inverse_transpose(m)
            mirrored = determinant(m) < 0
            mirrors += mirrored
            baked = mesh_scene(
                [[a + b for a, b in zip(multiply(m, p), move)] for p in points],
                [unit(multiply(turned, v)) for v in normals],
                [i for k in range(0, len(indices), 3)
                 for i in (indices[k:k + 3][::-1] if mirrored else indices[k:k + 3])])
            placed = mesh_scene(points, normals, indices, node={"matrix": columns_of(m, move)})
            a, b = (rgb(self.d.render(self.d.upload(file), request)) for file in (placed, baked))
            self.assertEqual(off_by_more_than(a, b, 8), 0, "transform %d: %s" % (n, m))
        self.assertGreater(mirrors, 10)

    def same_normals(self, *files):
        request = {"width": 96, "height": 72, "technique": {"name": "none"},
                   "output": {"layer": "normal"}}
        a, b = (self.picture(self.d.upload(file), **request) for file in files)
        self.assertEqual(off_by_more_than(a, b, 8), 0)

    def test_normal_maps_are_the_baked_ones(self):
        """A mirror turns the bitangent round, which the file's tangents say by w; given tangents, made
        ones, and those of instances."""
        points, normals, indices = wedge()
        tangents = []
        for k, n in enumerate(normals):
            first = points[k - k % 4:k - k % 4 + 2]
            along = [b - a for a, b in zip(*first)]
            dot = sum(a * b for a, b in zip(along, n))
            tangents.append(unit([a - dot * b for a, b in zip(along, n)]) + [1])
        rng = random.Random(9)
        mirrors = 0
        for n in range(12):
            turn, size = unit([rng.gauss(0, 1) for _ in range(4)]), [
                rng.choice((-1, 1)) * rng.randint(16, 96) / 64 for _ in range(3)]
            m = random_matrix(rng)
            if n % 3 == 0:
                x, y, z, w = turn
                m = [[(1 - 2 * (y * y + z * z)) * size[0], 2 * (x * y - z * w) * size[1],
                      2 * (x * z + y * w) * size[2]],
                     [2 * (x * y + z * w) * size[0], (1 - 2 * (x * x + z * z)) * size[1],
                      2 * (y * z - x * w) * size[2]],
                     [2 * (x * z - y * w) * size[0], 2 * (y * z + x * w) * size[1],
                      (1 - 2 * (x * x + y * y)) * size[2]]]
            turned, mirrored = inverse_transpose(m), determinant(m) < 0
            mirrors += mirrored
            given, used = tangents if n % 3 < 2 else None, normals
            node = {"matrix": columns_of(m)} if n % 3 else {
                "instance": {"ROTATION": turn, "SCALE": size}}
            baked = [unit(multiply(m, t[:3])) + [-1 if mirrored else 1] for t in given or ()]
            with self.subTest(transform=n):
                self.same_normals(
                    bent(points, used, given, indices, TILTS[0], **node),
                    bent([multiply(m, p) for p in points], [unit(multiply(turned, v)) for v in used],
                         baked, [i for k in range(0, len(indices), 3) for i in
                                 (indices[k:k + 3][::-1] if mirrored else indices[k:k + 3])],
                         TILTS[0]))
        self.assertGreater(mirrors, 3)

    def test_made_tangents_are_the_baked_ones(self):
        """A curved mesh without tangents, sheared and mirrored by its node or in the file."""
        points, normals, uv, indices = knot()
        rng = random.Random(11)
        mirrors = 0
        for n in range(50):
            m = random_matrix(rng)
            turned, mirrored = inverse_transpose(m), determinant(m) < 0
            mirrors += mirrored
            with self.subTest(transform=n):
                self.same_normals(
                    bent(points, normals, None, indices, TILTS[0], uv, matrix=columns_of(m)),
                    bent([multiply(m, p) for p in points],
                         [unit(multiply(turned, v)) for v in normals], None,
                         [i for k in range(0, len(indices), 3) for i in
                          (indices[k:k + 3][::-1] if mirrored else indices[k:k + 3])],
                         TILTS[0], uv))
        self.assertGreater(mirrors, 10)

    def test_normal_maps_lie_as_they_are_looked_up(self):
        """Made tangents follow the texture's set and its transform: turned, stretched, mirrored."""
        points, normals, uv, indices = knot()
        rng = random.Random(12)
        for n in range(8):
            turn, size = rng.uniform(-3, 3), [rng.choice((-1, 1)) * rng.uniform(0.3, 3)
                                              for _ in range(2)]
            c, s = math.cos(turn), math.sin(turn)  # KHR_texture_transform: T R S
            moved = [[c * size[0] * u + s * size[1] * v, -s * size[0] * u + c * size[1] * v]
                     for u, v in uv]
            for uv_set in (0, 1):
                with self.subTest(transform=n, uv_set=uv_set):
                    self.same_normals(
                        bent(points, normals, None, indices, TILTS[0], uv, uv_set,
                             {"rotation": turn, "scale": size, "offset": [0.5, 0.25]}),
                        bent(points, normals, None, indices, TILTS[0], moved))
            # On a sheet, worked out by hand: the bump leans along growing u, and green up.
            sheet = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
            file = bent(sheet, [[0, 0, 1]] * 4, None, [0, 1, 2, 0, 2, 3], TILTS[0],
                        [[p[0], -p[1]] for p in sheet], 1, {"rotation": turn, "scale": size})
            tilt = [x / 127.5 - 1 for x in TILTS[0]]
            along = unit([c / size[0], -s / size[1], 0])
            up = [-along[1], along[0], 0]
            if up[0] * s / size[0] + up[1] * c / size[1] < 0:  # against growing v
                up = [-x for x in up]
            bump = unit([a * tilt[0] + b * tilt[1] + z * tilt[2]
                         for a, b, z in zip(along, up, (0, 0, 1))])
            seen = self.picture(self.d.upload(file), ground=False, output={"layer": "normal"},
                                camera={"eye": [0, 0, 5], "target": [0, 0, 0], "fov_y_deg": 30})
            middle = seen[SIZE["height"] // 2 * SIZE["width"] + SIZE["width"] // 2]
            for value, expected in zip(middle, bump):
                self.assertAlmostEqual(value, 127.5 * (1 + expected), delta=3)

    def test_normal_maps_from_behind(self):
        """A bump is a dent there, leaning the same way in the world."""
        sheet, order = [[-1, -1, 0], [-1, 1, 0], [1, 1, 0], [1, -1, 0]], [0, 1, 2, 0, 2, 3]
        up = [0, 1, 0]
        self.same_normals(
            bent(sheet, [[0, 0, -1]] * 4, [up + [1]] * 4, order, TILTS[0]),
            bent(sheet, [[0, 0, 1]] * 4, [up + [-1]] * 4, order[::-1], TILTS[1]))

    def test_nothing_but_a_point_shows_the_ground(self):
        """Triangles without any extent."""
        request = {"technique": "pcss"}
        seen = [self.picture(self.d.upload(mesh_scene(p, [[0, 1, 0]] * 3, [0, 1, 2])), **request)
                for p in ([[1, 1, 1]] * 3, [[0, 0, 0]] * 3)]
        for picture in seen:
            self.assertGreater(min(min(p) for p in picture), 100)
            self.assertEqual(off_by_more_than(picture, seen[0], 2), 0)

    def test_white_box_from_all_sides(self):
        scene = self.d.upload(mesh_scene(*box()))
        for n in range(12):
            camera = {"camera": {"orbit": {"azimuth_deg": 30 * n + 5}}}
            beauty = self.picture(scene, **camera)
            faces, normals = {}, self.picture(scene, **camera, output={"layer": "normal"})
            for color, normal in zip(beauty, normals):
                faces.setdefault(normal, []).append(sum(color) / 3)
            # The ground's normal is that of the top, and it is seen from all sides: it is told by depth.
            means = [sum(v) / len(v) for k, v in faces.items()
                     if len(v) > 100 and k not in ((128, 128, 128), (128, 255, 127), (128, 255, 128))]
            self.assertGreaterEqual(len(means), 1, n)
            self.assertGreater(max(means), 180, "azimuth %d: %s" % (n, means))
            self.assertGreater(min(means), 60, "azimuth %d: %s" % (n, means))
            ground = self.picture(scene, **camera, output={"layer": "visibility"})
            dark = sum(1 for v, k in zip(ground, normals) if k in ((128, 255, 127), (128, 255, 128))
                       and v[0] < 64)
            self.assertGreater(dark, 0.01 * len(ground), "no shadow on the ground, azimuth %d" % n)

    def test_subject_fills_the_frame(self):
        for size in ((1, 1, 1), (0.2, 3, 0.2), (40, 10, 20)):
            scene = self.d.upload(mesh_scene(*box(size)))
            position = self.picture(scene, ground=False, output={"layer": "normal"})
            rows = [y for y in range(SIZE["height"])
                    if any(position[y * SIZE["width"] + x] != (128, 128, 128)
                           for x in range(SIZE["width"]))]
            columns = [x for x in range(SIZE["width"])
                       if any(position[y * SIZE["width"] + x] != (128, 128, 128)
                              for y in range(SIZE["height"]))]
            share = max(len(rows) / SIZE["height"], len(columns) / SIZE["width"])
            self.assertGreater(share, 0.8, size)
            self.assertLess(share, 0.98, size)
            self.assertLess(abs(rows[0] + rows[-1] + 1 - SIZE["height"]), 6, size)
            self.assertLess(abs(columns[0] + columns[-1] + 1 - SIZE["width"]), 6, size)

    def lit_by(self, *lights):
        """A grey box (albedo 0.5) with the file's own lights, each with its node's place."""
        nodes = [{"extensions": {"KHR_lights_punctual": {"light": i}}, **node}
                 for i, (_, node) in enumerate(lights)]
        return self.d.call("POST", "/v1/scenes", mesh_scene(
            *box(), color=(0.5, 0.5, 0.5, 1), nodes=nodes, extensionsUsed=["KHR_lights_punctual"],
            extensions={"KHR_lights_punctual": {"lights": [light for light, _ in lights]}}),
            {"Content-Type": "model/gltf-binary"}).json()

    def test_a_light_that_cannot_be_seen_is_said(self):
        for power, warned in ((99, False), (4e4, True)):
            info = self.lit_by(({"type": "directional", "intensity": power}, {}),
                               ({"type": "point", "intensity": 5, "name": "L\u00e4mpchen"}, {}))
            self.assertEqual(len(info["warnings"]), warned, info["warnings"])
            self.assertTrue(not warned or "\"L\u00e4mpchen\" has 5 cd" in info["warnings"][0])

    def lit_mean(self, light, node):
        """Mean of the pixels of the box that the file's own light reaches."""
        info = self.lit_by((light, node))
        self.assertEqual(info["warnings"], [])
        scene = info["id"]
        lit = self.picture(scene, output={"layer": "visibility"}, ground=False)
        none = self.picture(scene, output={"layer": "normal"}, ground=False)
        beauty = self.picture(scene, ground=False)
        reached = [sum(c) / 3 for c, v, n in zip(beauty, lit, none)
                   if v[0] > 128 and n != (128, 128, 128)]
        self.assertGreater(len(reached), 100)
        answer = self.d.render(scene, {**SIZE, "ground": False}, Accept="application/json").json()
        self.assertIsInstance(answer["request"]["exposure_ev"], float)
        return sum(reached) / len(reached)

    def test_exposure_suits_the_files_own_lights(self):
        turned = {"rotation": [-0.5, 0.2, 0.1, 0.836]}  # down and from the side
        for light, node in (
                ({"type": "directional", "intensity": 3}, turned),
                ({"type": "directional", "intensity": 100000}, turned),
                ({"type": "point", "intensity": 5}, {"translation": [1, 2, 1.5]}),
                ({"type": "point", "intensity": 80}, {"translation": [1, 2, 1.5]}),
                ({"type": "point", "intensity": 5}, {"translation": [0, 0.2, 0.9]}),
                ({"type": "point", "intensity": 80}, {"translation": [0, 3, 0]}),
                ({"type": "directional", "intensity": 3}, {"rotation": [-0.5 ** 0.5, 0, 0, 0.5 ** 0.5]}),
                ({"type": "spot", "intensity": 80, "spot": {"outerConeAngle": 0.9}},
                 {"translation": [0.5, 2.5, 0.5], "rotation": [-0.68, 0.1, 0.1, 0.72]})):
            mean = self.lit_mean(light, node)
            self.assertGreater(mean, 90, light)
            self.assertLess(mean, 200, light)

    def test_exposure_suits_narrow_beams_and_far_sides(self):
        """Whatever share of the object its lights reach, the mean of all of it suits; of what turns its
        back on a lamp that is as strong, only the sky is seen."""
        def spot(angle, at, turn):
            return ({"type": "spot", "intensity": 80, "spot": {"outerConeAngle": angle}},
                    {"translation": at, "rotation": turn})

        ahead, above = [0, 0, 0, 1], [-0.5 ** 0.5, 0, 0, 0.5 ** 0.5]
        for least, lights in (
                (90, [spot(0.02, [0, 0, 3], ahead)]), (90, [spot(0.1, [0, 0, 3], ahead)]),
                (90, [spot(0.2, [0, 3, 0], above)]),
                (90, [spot(0.3, [0, 0, 3], ahead), spot(0.05, [0, 3, 0], above)]),
                (90, [({"type": "point", "intensity": 8e10}, {"translation": [6e4, 8e4, 5e4]})]),
                (90, [({"type": "directional", "intensity": 3, "color": [1, 0.02, 0.02]},
                       {"rotation": above})]),
                (80, [({"type": "point", "intensity": 5}, {"translation": [0, 0.3, -2]})]),
                (80, [({"type": "directional", "intensity": 3}, {"rotation": [0, 1, 0, 0]})])):
            scene = self.lit_by(*lights)["id"]
            there = self.picture(scene, ground=False, output={"layer": "normal"})
            shown = [sum(c) / 3 for c, n in zip(self.picture(scene, ground=False), there)
                     if n != (128, 128, 128)]
            self.assertGreater(sum(shown) / len(shown), least, lights)
            self.assertLess(sum(shown) / len(shown), 200, lights)

    def test_exposure_of_a_narrow_beam_is_that_of_its_middle(self):
        """Of what stands at the object's middle: .72 of white for a surface of 67 % there. The box's
        front is half a metre nearer. Without sky and at 45 degrees from its axis no gloss."""
        request = {"sky": False, "ground": False, "antialias": 1, "edges": "none",
                   "camera": {"eye": [3, 0, 3], "target": [0, 0, 0.5]}}
        for angle in (0.08, 0.12):
            scene = self.lit_by(({"type": "spot", "intensity": 80,
                                  "spot": {"outerConeAngle": angle}}, {"translation": [0, 0, 3]}))["id"]
            most = max(max(p) for p in self.picture(scene, **request))
            linear = 0.5 * 0.72 / 0.67 * (3 / 2.5) ** 2
            self.assertAlmostEqual(most, 255 * (1.055 * linear ** (1 / 2.4) - 0.055), delta=8)

    def test_exposure_is_steady(self):
        scene = self.d.upload(mesh_scene(*wedge()))
        found = {self.d.render(scene, {**SIZE, "camera": {"orbit": {"azimuth_deg": a}}},
                               Accept="application/json").json()["request"]["exposure_ev"]
                 for a in range(0, 360, 45)}
        self.assertEqual(len(found), 1, found)

    def test_sky_can_be_switched_off(self):
        scene = self.d.upload(mesh_scene(*box()))
        dark = self.picture(scene, sky=False, lights=[], exposure_ev=0)
        self.assertEqual(max(max(p) for p in dark), 0)
        self.assertGreater(max(max(p) for p in self.picture(scene, lights=[])), 60)

    def test_what_shines_by_itself(self):
        scene = self.d.upload(mesh_scene(*box(), color=(0, 0, 0, 1),
                                         material={"emissiveFactor": [0.25, 0.25, 0.25]}))
        request = {"sky": False, "lights": [], "exposure_ev": 0, "ground": False, "edges": "none"}
        shown = {p for p in self.picture(scene, **request)}
        self.assertEqual(shown, {(0, 0, 0), (137, 137, 137)})  # sRGB of 0.25


if __name__ == "__main__":
    harness.main()
