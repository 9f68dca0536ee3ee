"""Every command that README and docs/ show in a block is run, on small simulated captures.

Words in capitals stand for the reader's own files: WORDS says which simulated ones take their place. What is in square
brackets is left out, and of A|B the first is taken. INSTEAD has commands whose words mean something else on their page,
and options that make a command quick; NOT_RUN those that need what a test does not have, with the reason.
"""

import contextlib
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest

import scenes

PAGES = [scenes.SOURCE / "README.md", *sorted((scenes.SOURCE / "docs").glob("*.md"))]
FENCE = re.compile(r"^\s*```")

# Files of the reader's, and scenes of the pages' examples.
WORDS = {
    "SCENE": "scene", "desk": "scene",
    "PHOTOS": "capture/images", "IMAGES": "capture/images", "INPUT": "capture/images", "photos": "capture/images",
    "WORKSPACE": "workspace", "transforms.json": "capture.json", "PHOTO": "desk_0000.jpg", "NAME": "delaunay",
    "DENSE": "dense", "DENSE/stereo": "dense/stereo", "DENSE/meshed-poisson.ply": "dense/meshed-poisson.ply",
    "VIDEO": "film/video.mp4", "shaky.mp4": "film/video.mp4", "A.mp4": "film/video.mp4", "LIST": "list.txt",
    "FILE": "scene/proxies/delaunay.ply", "PATH.json": "path.json", "MODEL": "smooth",
    "i/n": "1/3", "N": "400", "M": "2", "D": "30",
}
# The same on one page. After -o a scene is a new one.
PAGE_WORDS = {
    "stabilize.md": {"SCENE": "steady", "INPUT": "film/video.mp4"},
    "timeperiodic.md": {"SCENE": "lamp", "VIDEO": "lamp-film/video.mp4", "T": "15.37"},
}
MADE = {"SCENE": "made", "scene": "made", "OUT": "out", "DIR": "dir", "FILE.json": "made.json", "FOLDER": "made",
        "PATH.json": "made.json", "FILE.html": "made.html", "FILE.glb": "made.glb", "transforms.json": "made.json",
        "CAPTURE": "simulated"}

# What makes a command quick, by how it begins. Small pictures, short films, few settings.
QUICK = [
    (r"lumi-render tradeoff .*--time-windows", "--width 96"),
    (r"lumi-render tradeoff .*--ablation", "--width 96"),
    (r"lumi-render tradeoff", "--quick --width 96 --views 1 --repeats 1"),
    (r"lumi-render methods", "--methods ulr --methods pulli-1997 --width 96 --views 1 --repeats 1"),
    (r"lumi-render (?!.*--(path|view|holdout|seconds)\b)(?!properties|table)", "--seconds 0.2 --width 160"),
    (r"lumi-pipeline .*--stabilize", "--no-score"),
    (r"lumi-pipeline .*--tradeoff", "--no-video --no-web --holdout 4 --minutes 0.01"),
    (r"lumi-pipeline .*--batch", "--proxy plane --no-web --seconds 0.2 --width 160"),
    (r"lumi-pipeline .*--minutes", "--seconds 0.2 --width 160"),
    (r"lumi-pipeline", "--seconds 0.2 --width 160 --proxy-minutes 0"),
    (r"lumi-proxy dense .*--tradeoff", "--choose-width 96 --width 96"),
    (r"lumi-proxy dense", "--width 96"),
    (r"lumi-proxy auto", "--proxy-minutes 0"),
]
# By page and a part of the line as it is shown.
INSTEAD = [
    ("calibrate.md", "lumi-calibrate PHOTOS", "lumi-calibrate boards/images --board 9x6 --square-mm 25 -o camera.yaml"),
    ("cluster.md", "--batch LIST", "lumi-pipeline --batch list.txt -o out"),
    ("gallery.md", "lumi-render stage", "lumi-render stage -o out --view 4 --time-s 0.2"),
    ("methods.md", "table-3-1", "lumi-render table-3-1 methods/methods.json methods/methods.json"),
    ("proxy.md", "lumi-proxy box", "lumi-proxy box corridor"),
    ("proxy.md", "lumi-proxy moving", "lumi-proxy moving lamp-scene"),
    ("proxy.md", "lumi-proxy silhouettes", "lumi-proxy silhouettes scene --rule 'R + G + B > 100'"),
    ("proxy.md", "lumi-proxy hull", "lumi-proxy hull car --silhouettes car/truth/silhouettes"),
    ("reconstruct.md", "lumi-reconstruct IMAGES", "lumi-reconstruct capture/images -o made"),
    ("reconstruct.md", "--measure A B", "lumi-reconstruct scene --measure 0.1,0,0 0,0.2,0 1.20"),
    ("render.md", "--path PATH.json", "lumi-render steady -o out --path path.json --proxy per-view --border fill"),
    ("simulate.md", "lumi-simulate SCENE.json", "lumi-simulate --example desk -o simulated --views 2 --width 64"),
    ("stabilize.md", "--view PHOTO", "lumi-render steady --view 3 -o out"),
    ("timeperiodic.md", "--poses dino_par.txt",
     "lumi-reconstruct capture/images -o made --poses capture/truth/sparse --times times.csv --matching sequential"),
    ("timeperiodic.md", "lumi-timeperiodic calibrate",
     "lumi-timeperiodic calibrate lamp-film/video.mp4 -o made --fixed-video lamp-film/fixed.mp4 --backend factorization"),
    ("tradeoff.md", "--time-windows", "lumi-render tradeoff lamp -o out --time-windows"),
    ("timeperiodic.md", "--view dino0050.jpg", "lumi-render lamp -o out --view 5 --leave-out"),
    ("tutorial.md", "lumi-pipeline capture/images", "lumi-pipeline capture/images -o made"),
    ("tutorial.md", "--seconds 20", "lumi-render garden -o tour.mp4 --seconds 1 --width 160"),
    ("tutorial.md", "lumi-simulate", "lumi-simulate --example desk --views 24 --width 640 -o garden-photos"),
]
NOT_RUN = [
    ("bad-input.md", "lumi-", "what a program says"),
    ("capture-fails.md", "lumi-pipeline: photos", "what a program says"),
    ("cluster.md", "SCENE --executor slurm", "slurm_cluster_test and depth_map_parts_test run it"),
    ("large.md", "lumi-proxy: ", "what a program says"),
    ("pipeline.md", "dinosaur/images", "needs the dinosaur's photos"),
    ("reconstruct.md", "--clips FOLDER", "takes minutes: odd_photos_test runs it"),
]


def shown_commands():
    """(page, command) of every command in a block; what follows after two blanks is a description."""
    seen = set()
    for page in PAGES:
        fenced = False
        for line in page.read_text(encoding="utf-8").splitlines():
            if FENCE.match(line):
                fenced = not fenced
            if not fenced and not line.startswith("    "):
                continue
            command = re.split(r"\s{2,}(?=\S)", line.strip())[0]
            if re.match(r"lumi-[a-z]+:? ", command) and (page.name, command) not in seen:
                seen.add((page.name, command))
                yield page.name, command


def found(table, page, command):
    """The last element of the table's first row for the page whose text stands in the command."""
    return next((row[-1] for row in table if row[0] == page and row[1] in command), None)


def concrete(page, command):
    """The command with files in place of words."""
    text = found(INSTEAD, page, command)
    if text is None:
        while re.search(r"\[[^\[\]]*\]", command):
            command = re.sub(r"\s*\[[^\[\]]*\]", "", command)
        # Whole commands that go on with another one: "--view PHOTO | --holdout N".
        command = command.split(" | ")[0].replace(" ... ", " ")
        words = []
        for word in re.findall(r"'[^']*'|\S+", command):
            if "|" in word and not word.startswith("'"):
                word = word.split("|")[0]
            made = words and words[-1] in ("-o", "--tradeoff")
            word = (MADE.get(word) if made else None) or PAGE_WORDS.get(page, {}).get(word) or WORDS.get(word, word)
            words.append(word)
        text = " ".join(words)
    options = next((more for begins, more in QUICK if re.match(begins, text)), "")
    if text.startswith("lumi-view"):
        return f"xvfb-run -a {text}" if "--script" in text else f"xvfb-run -a {text} --no-ui --script wait"
    return f"{text} {options}" if options and "--seconds" not in text else text


class World:
    """Small captures and scenes, made once; each command runs in a copy of their folder."""

    def __init__(self):
        self.folder = scenes.scratch() / "shown"
        self.folder.mkdir()
        run = self.run
        run("lumi-simulate --example desk --views 24 --width 320 -o capture")
        (self.folder / "workspace").mkdir()
        shutil.copytree(self.folder / "capture/images", self.folder / "workspace/images")
        shutil.copytree(self.folder / "capture/truth/sparse", self.folder / "workspace/sparse")
        run("lumi-pipeline workspace -o scene --proxy delaunay --holdout 0 --no-video --no-web")
        run("lumi-reconstruct export scene -o capture.json")
        # The tutorial's scene, with the proxies that it makes on the way.
        shutil.copytree(self.folder / "scene", self.folder / "garden")
        run("lumi-proxy planes garden")
        run("lumi-proxy planes garden --leave-out 8")
        # As COLMAP leaves its dense workspace: cameras, photos, maps, a mesh.
        shutil.copytree(self.folder / "workspace", self.folder / "dense")
        run("lumi-proxy dense scene --width 160 --depth-only -o dense/stereo")
        shutil.copy(self.folder / "scene/proxies/delaunay.ply", self.folder / "dense/meshed-poisson.ply")
        run("lumi-render methods scene -o methods --properties --methods ulr --methods pulli-1997 --width 96 --views 1 --repeats 1")
        run("lumi-simulate --example plaza --views 36 --width 96 -o plaza")
        run("lumi-simulate --example boards -o boards")
        run("lumi-simulate --example car --views 16 --width 160 -o car")
        run("lumi-simulate --example stage --width 96 --fixed-frames 12 -o stage")
        run("lumi-simulate --example hallway --views 40 --width 160 -o corridor")
        run("lumi-simulate --example hallway --video --views 48 --width 256 --shake 2 -o film")
        run("lumi-reconstruct film/video.mp4 -o steady --backend factorization --projective --all-frames")
        run("lumi-stabilize steady -o path.json --model smooth")
        self.film_of_a_lamp()
        # The film's true camera, as ROS writes it.
        focal_px, _, x_px, y_px = self.true_camera("film")
        (self.folder / "camera.yaml").write_text(
            f"image_width: {2 * x_px:.0f}\nimage_height: {2 * y_px:.0f}\ncamera_name: film\n"
            f"camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{focal_px}, 0, {x_px}, 0, {focal_px}, {y_px}, 0, 0, 1]\n"
            "distortion_model: plumb_bob\n"
            "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0, 0, 0, 0, 0]\n")
        photos = sorted(p.name for p in (self.folder / "capture/images").iterdir())
        (self.folder / "times.csv").write_text("".join(f"{p},{i / 10}\n" for i, p in enumerate(photos)))
        (self.folder / "list.txt").write_text("workspace\n")

    def film_of_a_lamp(self):
        """The example as the tests of periods have it: one ray a pixel, a turn in 15.37 frames."""
        scene = json.loads((scenes.SOURCE / "simulate/examples/lamp.json").read_text())
        scene["image"] = {"samples_per_pixel": 1}
        scene["cameras"][0]["size"] = [240, 180]
        scene["period_s"] = 15.37 / 30
        for thing in scene["objects"]:
            if "spin" in thing:
                thing["spin"]["period_s"] = 15.37 / 30
        for light in scene["lights"]:
            light.pop("size_deg", None)
        scene["path"].update({"views": 80, "period_s": 1.6})
        scene["fixed_video"]["frames"] = 60
        (self.folder / "lamp.json").write_text(json.dumps(scene))
        self.run("lumi-simulate lamp.json -o lamp-film")
        self.run("lumi-timeperiodic calibrate lamp-film/video.mp4 -o lamp --fixed-video lamp-film/fixed.mp4 "
                 f"--backend factorization --focal-px {self.true_camera('lamp-film')[0]}")
        self.run("lumi-proxy plane lamp")
        shutil.copytree(self.folder / "lamp", self.folder / "lamp-scene")

    def true_camera(self, capture):
        return json.loads((self.folder / capture / "truth/cameras.json").read_text())["views"][0]["params"]

    @contextlib.contextmanager
    def copy(self):
        """A folder as this one. Its files are links: programs replace files, and change none in place."""
        with tempfile.TemporaryDirectory(dir=self.folder.parent) as folder:
            here = os.path.join(folder, "here")
            shutil.copytree(self.folder, here, copy_function=os.link)
            yield here

    def run(self, command, folder=None):
        environment = dict(os.environ, PATH=f"{scenes.BIN}:{os.environ['PATH']}", XDG_CONFIG_HOME=str(self.folder))
        result = subprocess.run(command, shell=True, cwd=folder or self.folder, env=environment, timeout=300,
                                stdin=subprocess.DEVNULL, capture_output=True, text=True)
        if folder is None and result.returncode:
            raise RuntimeError(f"{command}: exit code {result.returncode}\n{result.stderr[-2000:]}")
        return result


class ShownCommands(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.world = World()

    def test_every_one_runs(self):
        done = set()
        for page, command in shown_commands():
            if found(NOT_RUN, page, command):
                continue
            text = concrete(page, command)
            if text in done or (text.startswith("xvfb-run") and not shutil.which("xvfb-run")):
                continue
            done.add(text)
            with self.subTest(page=page, shown=command, run=text), self.world.copy() as here:
                result = self.world.run(text, here)
                self.assertEqual(result.returncode, 0, result.stderr[-1500:])
        self.assertGreater(len(done), 80)

    def test_no_exception_is_left_over(self):
        shown = list(shown_commands())
        for table in (INSTEAD, NOT_RUN):
            for page, part, _ in table:
                self.assertTrue(any(page == p and part in c for p, c in shown), f"{page} shows no {part}")


if __name__ == "__main__":
    unittest.main()
