#!/usr/bin/env python3
"""A new measure, tried in Python: photos that see the surface from nearer count more.

    own_measure.py SCENE [--holdout 8] [--width 480] [--power 1]

The renderer's measures are C++ (render/radiance/measures), so a new one is best tried here first: the weights of the
plan are multiplied by a factor of one's own and made to sum to 1 again. Held-out photos say whether it helps.
"""

import argparse

import numpy as np

import lumigraph as lg
from own_weights import blend


def nearness(scene, plan, power):
    """(h, w, k): how near each photo of the plan is to the point, relative to the nearest of them; in (0, 1]."""
    used = plan.photos >= 0
    centres = scene.centres[np.maximum(plan.photos, 0)]
    distance = np.linalg.norm(plan.points[:, :, None, :] - centres, axis=3)
    distance = np.where(used, distance, np.inf)
    with np.errstate(invalid="ignore"):
        factor = (distance.min(axis=2, keepdims=True) / distance) ** power
    return np.where(used & np.isfinite(factor), factor, 0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("--holdout", type=int, default=8, help="every N-th photo is rendered from the others")
    parser.add_argument("--width", type=int, default=480)
    parser.add_argument("--power", type=float, default=1.0, help="0: the measure does not count")
    o = parser.parse_args()

    lum = lg.open(o.scene, settings={"prefilter": "off", "exposure": "off", "resolution": "off"})
    held_out = lum.scene.names[:: o.holdout]
    plain, measured = [], []
    for name in held_out:
        view = lum.scene.view(name, width=o.width)
        plan = lum.plan(view, leave_out=held_out)
        photo = lg.resize(lum.scene.read_photo(name), *view.size_px)
        for weights, errors in (plan.weights, plain), (plan.weights * nearness(lum.scene, plan, o.power), measured):
            total = weights.sum(axis=2, keepdims=True)
            weights = np.divide(weights, total, out=np.zeros_like(weights, dtype=float), where=total != 0)
            picture = np.clip(np.rint(blend(lum, plan, weights)), 0, 255).astype(np.uint8)
            errors.append(lg.psnr_db(picture, photo))
    print(f"{len(held_out)} photos held out: {np.mean(plain):.2f} dB without the measure, {np.mean(measured):.2f} with it")


if __name__ == "__main__":
    main()
