"""Scenes that the tests of the module share, made by the programs, once a process."""

import functools
import os
import pathlib
import shutil
import subprocess
import tempfile
import atexit

BIN = pathlib.Path(os.environ["LUMI_BIN_DIR"])
SOURCE = pathlib.Path(os.environ["LUMI_SOURCE_DIR"])


@functools.lru_cache(None)
def scratch():
    folder = pathlib.Path(tempfile.mkdtemp(prefix="lumigraph-python-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def run(program, *arguments):
    return subprocess.run([BIN / program, *arguments, "--quiet"], check=True, capture_output=True, text=True)


@functools.lru_cache(None)
def desk():
    """24 photos, 160 pixels wide, true cameras, and a mesh of the points."""
    scene = scratch() / "desk"
    run("lumi-simulate", "--example", "desk", "--views", "24", "--width", "160", "-o", scene)
    return scene


@functools.lru_cache(None)
def lamp():
    """A scene that repeats itself: photos with times, and a period."""
    scene = scratch() / "lamp"
    run("lumi-simulate", "--example", "lamp", "--views", "40", "--width", "96", "-o", scene)
    return scene


@functools.lru_cache(None)
def shaky():
    """A film's frames as a metric scene with times, and a steady path of projection matrices for it."""
    scene = scratch() / "shaky"
    run("lumi-simulate", "--example", "hallway", "--video", "--views", "36", "--width", "96", "--shake", "1.5", "-o", scene)
    path = scratch() / "steady.json"
    run("lumi-stabilize", scene, "-o", path, "--model", "smooth")
    return scene, path
