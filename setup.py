"""Builds the module and the programs that it starts with CMake, and packs them together.

LUMIGRAPH_BUILD=DIR takes what was built there (build/release, say) instead of building anew in build/python.
"""

import atexit
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parent
VERSION = re.search(r'kVersion = "([^"]+)"', (ROOT / "scene/program/version.h").read_text()).group(1)


# Nothing is left in the tree but build/python.
WORK = tempfile.mkdtemp(prefix="lumigraph-setup-")
atexit.register(shutil.rmtree, WORK, ignore_errors=True)


class BuildWithCMake(build_ext):
    def build_extension(self, ext):
        package = pathlib.Path(self.get_ext_fullpath(ext.name)).resolve().parent
        built = os.environ.get("LUMIGRAPH_BUILD")
        build = pathlib.Path(built).resolve() if built else ROOT / "build/python"
        if not built:
            subprocess.run(
                ["cmake", "--preset", "release", "-B", build, "-S", ROOT, "-DLUMI_TESTS=OFF", "-DLUMI_BENCHMARKS=OFF",
                 f"-DPython_EXECUTABLE={sys.executable}"], cwd=ROOT, check=True)
            subprocess.run(["cmake", "--build", build, "--parallel", str(os.cpu_count())], check=True)
        subprocess.run(["cmake", "--install", build, "--component", "wheel", "--prefix", package], check=True)


setup(
    version=VERSION,
    packages=["lumigraph"],
    package_dir={"lumigraph": "python/lumigraph"},
    package_data={"lumigraph": ["py.typed", "*.pyi"]},
    ext_modules=[Extension("lumigraph._core", sources=[])],
    cmdclass={"build_ext": BuildWithCMake},
    options={"build": {"build_base": WORK}, "egg_info": {"egg_base": WORK}, "bdist_wheel": {"bdist_dir": WORK + "/wheel"}},
    zip_safe=False,
)
