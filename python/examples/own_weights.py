#!/usr/bin/env python3
"""Blends a view in NumPy: once with the weights of the plan, once with weights of one's own on the same photos.

    own_weights.py SCENE [--view NAME] [--width 480] [-o FOLDER]

The plan names the photos of each pixel, their weights, and the point of the proxy that the pixel sees. What is left to
do is to project that point into each photo, to look up the photo's colour, and to sum.
"""

import argparse
import pathlib

import numpy as np

import lumigraph as lg


def bilinear(photo, xy_px):
    """Colours of a photo (h, w, 3) at points (n, 2) in pixels, whose centres lie at (i + 0.5, j + 0.5)."""
    h, w = photo.shape[:2]
    x, y = np.clip(xy_px[:, 0] - 0.5, 0, w - 1), np.clip(xy_px[:, 1] - 0.5, 0, h - 1)
    x0, y0 = np.minimum(x.astype(int), max(w - 2, 0)), np.minimum(y.astype(int), max(h - 2, 0))
    x1, y1 = np.minimum(x0 + 1, w - 1), np.minimum(y0 + 1, h - 1)
    fx, fy = (x - x0)[:, None], (y - y0)[:, None]
    top = photo[y0, x0] * (1 - fx) + photo[y0, x1] * fx
    bottom = photo[y1, x0] * (1 - fx) + photo[y1, x1] * fx
    return top * (1 - fy) + bottom * fy


def blend(lum, plan, weights):
    """(h, w, 3) in code values: the photos of the plan at its points, by these weights (h, w, k)."""
    scene = lum.scene
    height, width = plan.alpha.shape
    out = np.zeros((height * width, 3))
    photos, weights = plan.photos.reshape(height * width, -1), weights.reshape(height * width, -1)
    points = plan.points.reshape(-1, 3)
    P = scene.P
    for j, name in enumerate(scene.names):
        pixel, entry = np.nonzero((photos == j) & (weights != 0))
        if len(pixel) == 0:
            continue
        x = points[pixel] @ P[j, :, :3].T + P[j, :, 3]
        colour = bilinear(lum.photo(name), x[:, :2] / x[:, 2:])
        np.add.at(out, pixel, weights[pixel, entry][:, None] * colour)
    return out.reshape(height, width, 3) * plan.alpha[..., None]


def equal_shares(plan):
    """Weights of one's own: every photo of the plan counts alike."""
    used = plan.photos >= 0
    return used / np.maximum(used.sum(axis=2, keepdims=True), 1)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("--view", default="0", help="photo that is rendered from the others; default: the first")
    parser.add_argument("--width", type=int, default=480)
    parser.add_argument("-o", "--output", type=pathlib.Path, help="folder for pictures")
    o = parser.parse_args()

    # NumPy's lookup above is bilinear in the photo itself: the renderer's filter for smaller pictures is switched off.
    lum = lg.open(o.scene, settings={"prefilter": "off", "exposure": "off"})
    view = lum.scene.view(o.view, width=o.width)
    plan = lum.plan(view, leave_out=[o.view])
    ours = lum.render(view, leave_out=[o.view]).rgb
    same = np.clip(np.rint(blend(lum, plan, plan.weights)), 0, 255).astype(np.uint8)
    mean = np.clip(np.rint(blend(lum, plan, equal_shares(plan))), 0, 255).astype(np.uint8)
    apart = int(np.abs(ours.astype(int) - same.astype(int)).max())
    print(f"NumPy with the plan's weights and the renderer differ by at most {apart} code values")
    print(f"equal shares are {lg.psnr_db(mean, ours):.2f} dB from it")
    if o.output:
        o.output.mkdir(parents=True, exist_ok=True)
        for name, picture in ("renderer", ours), ("numpy", same), ("equal-shares", mean):
            lg.write_image(o.output / f"{name}.png", picture)


if __name__ == "__main__":
    main()
