"""pip install into a virtual environment with the system's packages and without a network, from what is built."""

import os
import subprocess
import sys
import unittest

import scenes


class Install(unittest.TestCase):
    def test_pip_installs_a_package_that_works_alone(self):
        for module, package in ("venv", "python3-venv"), ("ensurepip", "python3-venv"), ("setuptools", "python3-setuptools"), ("wheel", "python3-wheel"):
            try:
                __import__(module)
            except ImportError:
                self.skipTest(f"{package} is not installed")
        environment = scenes.scratch() / "venv"
        subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", environment], check=True)
        python = environment / "bin/python"
        variables = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
        subprocess.run([python, "-m", "pip", "install", "--quiet", "--no-build-isolation", "--no-index", "--no-deps", scenes.SOURCE],
                       check=True, env=dict(variables, LUMIGRAPH_BUILD=os.environ["LUMI_BUILD_DIR"]))
        script = (
            "import lumigraph as lg, sys\n"
            "assert '/venv/' in lg.__file__, lg.__file__\n"
            "assert '/venv/' in str(lg.program_path('lumi-proxy'))\n"
            "lum = lg.open(sys.argv[1])\n"
            "print(lum.render(lum.scene.view('0')).rgb.shape, lg.run('lumi-proxy', 'info', sys.argv[1])['version'])\n")
        done = subprocess.run([python, "-c", script, scenes.desk()], check=True, env=variables, cwd=scenes.scratch(), capture_output=True, text=True)
        self.assertIn("(120, 160, 3)", done.stdout)


if __name__ == "__main__":
    unittest.main()
