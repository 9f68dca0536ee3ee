"""The examples of python/examples run, and say what they should."""

import os
import re
import subprocess
import sys
import unittest

import scenes

EXAMPLES = scenes.SOURCE / "python/examples"


def example(name, *arguments):
    done = subprocess.run([sys.executable, "-B", EXAMPLES / f"{name}.py", *map(str, arguments)], capture_output=True, text=True)
    if done.returncode != 0:
        raise AssertionError(f"{name} failed:\n{done.stderr}")
    return done.stdout


class Examples(unittest.TestCase):
    def test_all_are_run_here(self):
        tested = {name for name in dir(self) if name.startswith("test_")}
        for file in EXAMPLES.glob("*.py"):
            self.assertIn(f"test_{file.stem}", tested)

    def test_own_weights(self):
        output = scenes.scratch() / "own-weights"
        said = example("own_weights", scenes.desk(), "--width", 160, "-o", output)
        self.assertLessEqual(int(re.search(r"at most (\d+) code values", said).group(1)), 1)
        self.assertEqual(len(list(output.glob("*.png"))), 3)

    def test_own_measure(self):
        said = example("own_measure", scenes.desk(), "--width", 160)
        without, with_it = map(float, re.search(r": ([\d.]+) dB without the measure, ([\d.]+)", said).groups())
        self.assertGreater(min(without, with_it), 18)
        off = example("own_measure", scenes.desk(), "--width", 160, "--power", 0)
        without, with_it = re.search(r": ([\d.]+) dB without the measure, ([\d.]+)", off).groups()
        self.assertEqual(without, with_it)

    def test_evaluate_workspace(self):
        # As COLMAP has it: photos and a model, no scene of ours.
        workspace = scenes.scratch() / "workspace"
        workspace.mkdir()
        os.symlink(scenes.desk() / "images", workspace / "images")
        os.symlink(scenes.desk() / "sparse", workspace / "sparse")
        table = scenes.scratch() / "figures.csv"
        said = example("evaluate_workspace", workspace, "--holdout", 8, "--width", 120, "--csv", table)
        self.assertIn("proxies: none", said)
        self.assertEqual(len(table.read_text().splitlines()), 4)

    def test_plot_weights(self):
        plot = scenes.scratch() / "weights.svg"
        said = example("plot_weights", scenes.desk(), "--samples", 120, "-o", plot)
        self.assertEqual(said.count("photos count"), 2)
        self.assertGreater(plot.read_text().count("<polyline"), 8)

    def test_sample_periodic(self):
        said = example("sample_periodic", scenes.lamp(), "--phases", 4, "--width", 96)
        moved = [float(d) for d in said.split("code values: ")[1].split(",")]
        self.assertEqual(len(moved), 5)
        self.assertGreater(max(moved[1:4]), 1)  # something moves,
        self.assertLess(moved[4], 0.01)         # and comes back


if __name__ == "__main__":
    unittest.main()
