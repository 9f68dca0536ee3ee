#!/usr/bin/env python3
"""Samples a time-periodic scene: one camera, pictures at phases of the period.

    sample_periodic.py SCENE [--phases 8] [--view NAME] [--width 320] [-o FOLDER]

lumi-pipeline VIDEO -o SCENE --periodic makes such a scene. Without one, the first and the last picture would differ; here
phase 1 is phase 0 again.
"""

import argparse
import pathlib

import numpy as np

import lumigraph as lg


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("--phases", type=int, default=8)
    parser.add_argument("--view", default="0", help="the photo whose camera looks; default: the first")
    parser.add_argument("--width", type=int, default=320)
    parser.add_argument("-o", "--output", type=pathlib.Path, help="folder for pictures")
    o = parser.parse_args()

    pictures = []
    for phase in np.linspace(0, 1, o.phases + 1):
        lum = lg.open(o.scene, phase=float(phase))
        if not pictures:
            print(f"period {lum.scene.period_s:.3f} s")
        pictures.append(lum.render(lum.scene.view(o.view, width=o.width)).rgb)
    moved = [float(np.abs(p.astype(float) - pictures[0]).mean()) for p in pictures]
    print("mean difference from phase 0, code values: " + ", ".join(f"{d:.2f}" for d in moved))
    if o.output:
        o.output.mkdir(parents=True, exist_ok=True)
        for i, picture in enumerate(pictures):
            lg.write_image(o.output / f"phase_{i:02d}.png", picture)


if __name__ == "__main__":
    main()
