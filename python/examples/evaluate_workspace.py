#!/usr/bin/env python3
"""Figures of any scene or COLMAP workspace: photos left out, rendered from the others.

    evaluate_workspace.py WORKSPACE [--proxy NAME] [--width 480] [--csv FILE]

A COLMAP workspace has no proxy: then each picture's own triangulated points serve (--proxy per-view).
"""

import argparse
import csv

import lumigraph as lg


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("workspace")
    parser.add_argument("--proxy", default="")
    parser.add_argument("--width", type=int, default=480)
    parser.add_argument("--holdout", default="auto", help="N, each or auto")
    parser.add_argument("--csv", help="a line a held-out photo goes here")
    o = parser.parse_args()

    scene = lg.open_scene(o.workspace)
    print(f"{len(scene)} photos, {len(scene.points)} points, proxies: {', '.join(scene.proxies) or 'none'}")
    proxy = o.proxy or ("" if scene.active_proxy else "per-view")
    figures = lg.evaluate(o.workspace, holdout=o.holdout, proxy=proxy, width=o.width)
    seen = figures.get("psnr_seen_mean_db")
    print(f"{len(figures['views'])} held out: {figures['psnr_mean_db']:.2f} dB over all pixels"
          + (f", {seen:.2f} dB over those that two photos see" if seen is not None else "")
          + f", SSIM {figures['ssim_mean']:.3f}; the nearest photo alone {figures['nearest_photo_psnr_mean_db']:.2f} dB")
    if o.csv:
        keys = ["name", "psnr_db", "psnr_seen_db", "ssim", "coverage"]
        with open(o.csv, "w", newline="", encoding="utf-8") as file:
            table = csv.DictWriter(file, keys, extrasaction="ignore")
            table.writeheader()
            table.writerows(figures["views"])


if __name__ == "__main__":
    main()
