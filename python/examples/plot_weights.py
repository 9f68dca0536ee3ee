#!/usr/bin/env python3
"""Plots how weights change along a line across a picture: real-time weights beside the optimum's.

    plot_weights.py SCENE [--view NAME] [--row 0.5] -o weights.svg

Each photo is a curve; the curves of a picture without seams are continuous, and sum to 1.
"""

import argparse
import colorsys

import numpy as np

import lumigraph as lg

WIDTH, HEIGHT, GAP = 640, 180, 30


def curves(weights, top, title):
    """SVG of (n, photos): a polyline a photo that counts anywhere."""
    low, high = min(0.0, weights.min()), max(1.0, weights.max())
    lines = [f'<text x="4" y="{top - 6}" font-size="13" font-family="sans-serif">{title}</text>',
             f'<rect x="0" y="{top}" width="{WIDTH}" height="{HEIGHT}" fill="none" stroke="#999"/>']
    x = np.linspace(0, WIDTH, len(weights))
    for j in np.flatnonzero(np.abs(weights).max(axis=0) > 0):
        r, g, b = (int(255 * c) for c in colorsys.hsv_to_rgb(j * 0.618 % 1, 0.85, 0.75))
        y = top + HEIGHT * (high - weights[:, j]) / (high - low)
        points = " ".join(f"{a:.1f},{c:.1f}" for a, c in zip(x, y))
        lines.append(f'<polyline fill="none" stroke="rgb({r},{g},{b})" points="{points}"/>')
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("--view", default="0", help="the photo whose camera looks, itself left out; default: the first")
    parser.add_argument("--row", type=float, default=0.5, help="height of the line, 0 (top) to 1")
    parser.add_argument("--samples", type=int, default=400)
    parser.add_argument("-o", "--output", default="weights.svg")
    o = parser.parse_args()

    lum = lg.open(o.scene)
    view = lum.scene.view(o.view)
    width, height = view.size_px
    xy = np.column_stack([np.linspace(0.5, width - 0.5, o.samples), np.full(o.samples, o.row * height)])
    svg = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {2 * (HEIGHT + GAP)}">']
    for i, (title, settings) in enumerate([("real-time weights", {}), ("the optimum", {"similarity": "full"})]):
        at = lum.weights_at(view, xy, leave_out=[o.view], settings=settings)
        dense = at.dense()
        covered = at.alpha > 0
        print(f"{title}: {int((np.abs(dense) > 0).any(axis=0).sum())} photos count, weights sum to "
              f"{dense[covered].sum(axis=1).min():.4f} ... {dense[covered].sum(axis=1).max():.4f}")
        svg += curves(dense, GAP + i * (HEIGHT + GAP), title)
    with open(o.output, "w", encoding="utf-8") as file:
        file.write("\n".join(svg + ["</svg>\n"]))
    print(o.output)


if __name__ == "__main__":
    main()
