"""What the penumbra client says of itself: --help, the page of the manual and the completion of three
shells have the same commands and options. Bash's is used in a real bash; zsh's and fish's where they
are installed."""
import re
import shutil
import subprocess
import unittest

import test_cli

COMMANDS = ("render", "watch", "compare", "sequence", "jobs", "scenes", "techniques", "generate",
            "completion", "version")


def output(*arguments):
    return subprocess.run([test_cli.PROGRAM, *arguments], capture_output=True, text=True,
                          check=True).stdout


def of_help(command):
    """{option} that --help lists, as they are typed."""
    text = output(command, "--help").split("\nKeys of --light")[0]
    options = set()
    for line in re.findall(r"^  (-.*)$", text, re.M):
        usage = re.split(r"  +", line)[0]
        options |= set(re.findall(r"(?<![\w-])--?[a-z][a-z-]*", usage))
    return options


class Shell(test_cli.Command):
    def test_help(self):
        overview = output("--help")
        for command in COMMANDS:
            self.assertIn("penumbra " + command, overview)
            self.assertEqual(output("help", command), output(command, "--help"))
            self.assertGreaterEqual(of_help(command), {"--help", "-h"})
            for line in output(command, "--help").split("\n"):
                self.assertLessEqual(len(line), 100, line)
        text = output("render", "--help")
        for part in ("default: 800", "rect, disk, sphere, sun, point, spot", "checker",
                     "sun: ", "disk, sphere: "):
            self.assertIn(part, text)

    def test_manual(self):
        page = output("manual")
        plain = page.replace("\\-", "-").replace("\\fB", "").replace("\\fR", "").replace("\\e", "\\")
        for command in COMMANDS:
            part = plain.split("\n.SH %s\n" % command.upper())[1].split("\n.SH ")[0]
            for option in of_help(command):
                self.assertRegex(part, r"\.TP\n(.*, )?%s\b" % re.escape(option), command)
        for tool, arguments in (("groff", ["-man", "-ww", "-z"]), ("mandoc", ["-Tlint", "-Wwarning"])):
            if shutil.which(tool):
                ran = subprocess.run([tool, *arguments], input=page, capture_output=True, text=True)
                lines = [line for line in (ran.stdout + ran.stderr).split("\n")
                         if line and "missing date" not in line]
                self.assertEqual((ran.returncode if tool == "groff" else 0, lines), (0, []), tool)

    # ---- bash ----

    def complete(self, *words):
        """What Tab offers behind these words, of which the last is being typed."""
        script = ("source <(%s completion bash)\nCOMP_WORDS=(%s)\nCOMP_CWORD=%d\n_penumbra\n"
                  'printf "%%s\\n" "${COMPREPLY[@]}"\n' % (
                      test_cli.PROGRAM, " ".join("'%s'" % w for w in ("penumbra", *words)), len(words)))
        ran = subprocess.run(["bash", "-c", script], cwd=self.folder, capture_output=True, text=True,
                             env={**test_cli.os.environ, "PENUMBRA_SERVER": self.stub.url,
                                  "PATH": test_cli.os.path.dirname(test_cli.PROGRAM) + ":" +
                                          test_cli.os.environ["PATH"]})
        self.assertEqual((ran.returncode, ran.stderr), (0, ""))
        return set(ran.stdout.split())

    def test_bash(self):
        self.assertEqual(self.complete(""), {*COMMANDS, "help"})
        self.assertEqual(self.complete("se"), {"sequence"})
        for command in COMMANDS:
            self.assertEqual(self.complete(command, "x", "-"), of_help(command), command)
        self.assertEqual(self.complete("render", "x", "--tone-map", ""), {"none", "reinhard", "aces"})
        self.assertEqual(self.complete("render", "x", "--background", "t"), {"transparent"})
        self.assertIn("demo", self.complete("generate", ""))
        self.assertEqual(self.complete("completion", ""), {"bash", "zsh", "fish"})
        self.assertEqual(self.complete("jobs", ""), {"list", "show", "wait", "cancel"})
        self.assertEqual(self.complete("render", "sc"), {"scene.glb"})
        self.assertEqual(self.complete("render", "x", "--json", "sc"), {"scene.glb"})
        (self.folder / "out").mkdir()
        self.assertEqual(self.complete("compare", "x", "--out", ""), {"out"})
        # Of the server: methods and scenes; and nothing, silently, where there is none.
        self.stub.script = [(200, {"techniques": [{"name": "pcss"}, {"name": "hard"}]})]
        self.assertEqual(self.complete("render", "x", "--technique", "p"), {"pcss"})
        self.stub.stored["/v1/scenes"]["12" * 32] = b""
        self.assertEqual(self.complete("scenes", "show", "1"), {"121212121212"})
        self.stub.script = [(500, {})]
        self.assertEqual(self.complete("render", "x", "--technique", "p"), set())

    # ---- others ----

    def test_every_option_is_in_every_completion(self):
        fish, zsh = output("completion", "fish"), output("completion", "zsh")
        for command in COMMANDS:
            of_zsh = re.search(r"^    %s\) (.*?) ;;$" % command, zsh, re.M | re.S)[1]
            of_fish = "\n".join(line for line in fish.split("\n")
                                if "from %s'" % command in line)
            for option in of_help(command):
                self.assertRegex(of_zsh, r"'%s\W" % re.escape(option), command)
                kind = "-l " if option.startswith("--") else "-s "
                self.assertRegex(of_fish, r"%s%s(\s|$)" % (kind, re.escape(option.lstrip("-"))), command)

    def test_syntax(self):
        for shell, check in (("bash", ["-n"]), ("zsh", ["-n"]), ("fish", ["--no-execute"])):
            if shutil.which(shell):
                ran = subprocess.run([shell, *check, "/dev/stdin"], input=output("completion", shell),
                                     capture_output=True, text=True)
                self.assertEqual((ran.returncode, ran.stderr), (0, ""), shell)

    @unittest.skipUnless(shutil.which("fish"), "no fish")
    def test_fish(self):
        script = output("completion", "fish") + "\ncomplete -C 'penumbra render x --ton'\n"
        ran = subprocess.run(["fish", "--no-config"], input=script, capture_output=True, text=True)
        self.assertIn("--tone-map", ran.stdout)


if __name__ == "__main__":
    test_cli.main()
