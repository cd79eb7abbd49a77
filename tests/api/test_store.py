"""A store that somebody or something has damaged: what is answered is right or says what is wrong,
the rest of the store is not affected, and uploading again heals it."""
import json
import os
import random
import shutil
import stat
import unittest

from harness import SMALL, Daemon, grid_scene, main, png, wait

FILES = ("source", "scene.pscene", "meta.json", "sums")


def cut(path):
    os.truncate(path, os.path.getsize(path) // 2)


def empty(path):
    os.truncate(path, 0)


def overwrite(path):
    """In the middle, a stretch of it, same length: the headers are whole."""
    middle = os.path.getsize(path) // 2
    with open(path, "r+b") as f:
        f.seek(middle)
        there = f.read(200)
        f.seek(middle)
        f.write(bytes(b ^ 0x55 for b in there))


def garbage(path):
    size = os.path.getsize(path)
    with open(path, "r+b") as f:
        f.write(random.Random(size).randbytes(size))


def folder_instead(path):
    os.unlink(path)
    os.mkdir(path)


DAMAGES = (cut, empty, overwrite, garbage, os.unlink, folder_instead)


class Store(unittest.TestCase):
    def setUp(self):
        self.d = Daemon()
        self.data = grid_scene(2, "hurt")
        self.id = self.d.upload(self.data)
        self.other = self.d.upload(grid_scene(3, "other"))
        self.picture = self.d.render(self.id, SMALL).body
        self.description = self.d.get("/v1/scenes/" + self.id).json()
        self.path = os.path.join(self.d.store, "scenes", self.id)

    def tearDown(self):
        if self.d.process.poll() is None:
            self.assertEqual(self.d.stop(), 0)
        self.d.kill()

    def restarted(self, damage):
        self.assertEqual(self.d.stop(), 0)
        damage()
        self.d.start()

    def check_others(self):
        """The list is valid, and whoever was not hurt is on it and is drawn."""
        listed = self.d.get("/v1/scenes").json()["scenes"]
        self.assertIn(self.other, [s["id"] for s in listed])
        return [s["id"] for s in listed]

    def settled(self, ask):
        """The answer once nothing is imported again any more; what comes until then says so."""
        def asked():
            answer = ask()
            if answer.status == 503:
                self.assertIn("imported again", answer.json()["detail"])
                self.assertGreater(int(answer.headers["Retry-After"]), 0)
            return answer.status != 503 and answer
        return wait(asked)

    def check_whole(self):
        answer = self.settled(lambda: self.d.render(self.id, SMALL))
        self.assertEqual((answer.status, answer.body == self.picture), (200, True), answer.body[:200])
        described = self.settled(lambda: self.d.get("/v1/scenes/" + self.id)).json()
        for key in self.description:
            if key not in ("resident", "stored_at", "stored_unix_s"):
                self.assertEqual(described[key], self.description[key], key)
        self.assertIn(self.id, self.check_others())

    def heal(self):
        """An upload of the same bytes; then all files are what they were in the beginning."""
        self.assertEqual(self.d.upload(self.data), self.id)
        self.check_whole()
        with open(os.path.join(self.path, "source"), "rb") as f:
            self.assertEqual(f.read(), self.data)
        self.assertEqual(sorted(n for n in os.listdir(self.path) if "calibration" not in n),
                         sorted(FILES))
        self.assertEqual(self.d.leftovers(), [])

    def test_one_file_while_it_runs(self):
        """The rest is enough to go on, without an upload."""
        for name in FILES:
            for damage in DAMAGES:
                with self.subTest(file=name, damage=damage.__name__):
                    damage(os.path.join(self.path, name))
                    self.check_others()
                    self.check_whole()
                    self.heal()

    def test_one_file_before_a_start(self):
        for name in FILES:
            for damage in DAMAGES:
                with self.subTest(file=name, damage=damage.__name__):
                    self.restarted(lambda: damage(os.path.join(self.path, name)))
                    self.check_others()
                    self.check_whole()
                    self.heal()

    def lose(self, damage):
        for name in ("source", "scene.pscene"):
            damage(os.path.join(self.path, name))

    def check_lost(self):
        self.check_others()
        answer = self.settled(lambda: self.d.render(self.id, SMALL))
        self.assertEqual(answer.status, 404, answer.body)
        self.assertEqual(self.settled(lambda: self.d.get("/v1/scenes/" + self.id)).status, 404)
        self.assertNotIn(self.id, self.check_others())
        self.assertIn(self.id, self.d.log())

    def test_source_and_blob(self):
        """Nothing is left to make it of: it is gone until it comes again."""
        for damage in DAMAGES:
            with self.subTest(damage=damage.__name__, restarted=False):
                self.lose(damage)
                self.check_lost()
                self.heal()
            with self.subTest(damage=damage.__name__, restarted=True):
                self.restarted(lambda: self.lose(damage))
                self.check_lost()
                self.heal()

    def test_a_folder(self):
        def emptied():
            shutil.rmtree(self.path)
            os.mkdir(self.path)

        def file_instead():
            shutil.rmtree(self.path)
            with open(self.path, "w") as f:
                f.write("not a folder")

        for damage in (emptied, file_instead, lambda: shutil.rmtree(self.path)):
            for restarts in (False, True):
                with self.subTest(damage=damage.__name__, restarted=restarts):
                    self.restarted(damage) if restarts else damage()
                    answer = self.settled(lambda: self.d.render(self.id, SMALL))
                    self.assertEqual(answer.status, 404, answer.body)
                    self.check_others()
                    self.heal()

    def test_without_being_asked_for(self):
        """What nobody opens is read now and then, and made again."""
        self.assertEqual(self.d.stop(), 0)
        self.d.flags.append("--scrub-s=1")
        self.d.start()
        wait(lambda: self.d.metric("penumbra_store_rounds_total") >= 1)
        self.assertEqual(self.d.metric("penumbra_store_faults_total"), 0)
        for name in ("scene.pscene", "meta.json", "sums"):
            with self.subTest(file=name):
                path = os.path.join(self.path, name)
                with open(path, "rb") as f:
                    whole = f.read()
                before = self.d.metric("penumbra_store_faults_total")
                overwrite(path)
                wait(lambda: self.d.metric("penumbra_store_faults_total") > before)
                wait(lambda: os.path.exists(path) and os.path.getsize(path) == len(whole) and
                     self.d.get("/v1/scenes/" + self.id).status == 200)
                self.check_whole()
        overwrite(os.path.join(self.path, "source"))
        wait(lambda: "an upload would mend it" in self.d.log())
        self.check_whole()
        self.heal()

    def test_an_image(self):
        data = png(8, 8)
        head = {"Content-Type": "image/png"}
        image = self.d.call("POST", "/v1/images", data, head).json()["id"]
        light = {"type": "rect", "position": [0, 3, 0], "target": [0, 0, 0], "width": 1, "height": 1,
                 "radiance": 9, "texture": {"image": image}}
        request = dict(SMALL, lights=[light])
        expected = self.d.render(self.id, request)
        self.assertEqual(expected.status, 200, expected.body)
        for name in ("source", "image.pscene", "meta.json", "sums"):
            for damage in (overwrite, os.unlink):
                with self.subTest(file=name, damage=damage.__name__):
                    damage(os.path.join(self.d.store, "images", image, name))
                    answer = self.settled(lambda: self.d.render(self.id, request))
                    self.assertEqual((answer.status, answer.body == expected.body), (200, True),
                                     answer.body[:200])
                    self.assertEqual(self.settled(lambda: self.d.get("/v1/images/" + image)).status,
                                     200)
                    again = self.d.call("POST", "/v1/images", data, head)
                    self.assertIn(again.status, (200, 201), again.body)

    def test_calibrations(self):
        """What `auto` has measured is not trusted blindly, either."""
        request = dict(SMALL, technique={"name": "auto"})
        self.assertEqual(self.d.render(self.id, request).status, 200)
        name = wait(lambda: [n for n in os.listdir(self.path) if n.startswith("calibration-")])[0]
        for damage in (overwrite, folder_instead):
            with self.subTest(damage=damage.__name__):
                path = os.path.join(self.path, name)
                if not os.path.isfile(path):
                    if os.path.isdir(path):
                        os.rmdir(path)
                    with open(path, "w") as f:
                        json.dump({"tables": [{"rows": [{"candidate": "x" * 9999}]}]}, f)
                damage(path)
                answer = self.d.render(self.id, request)
                self.assertEqual(answer.status, 200, answer.body)

    def refusal(self, prepare):
        """What the daemon says of a store that it cannot use."""
        self.assertEqual(self.d.stop(), 0)
        prepare()
        with self.assertRaises(RuntimeError) as caught:
            self.d.start()
        return str(caught.exception)

    def test_a_file_in_place_of_a_folder(self):
        def prepare():
            shutil.rmtree(os.path.join(self.d.store, "images"))
            with open(os.path.join(self.d.store, "images"), "w") as f:
                f.write("")

        text = self.refusal(prepare)
        self.assertIn("images", text)
        self.assertIn("Not a directory", text)

    @unittest.skipIf(os.geteuid() == 0, "root may write everywhere")
    def test_read_only(self):
        text = self.refusal(lambda: os.chmod(os.path.join(self.d.store, "scenes"), 0o500))
        os.chmod(os.path.join(self.d.store, "scenes"), stat.S_IRWXU)
        self.assertIn("Permission denied", text)


if __name__ == "__main__":
    main()
