"""Unstructured lumigraphs in Python: scenes, weights and pictures as NumPy arrays.

    import lumigraph as lg

    lum = lg.open("captures/garden")              # a scene, a COLMAP workspace, or a transforms.json
    view = lum.scene.view("IMG_0012.jpg", width=960)
    picture = lum.render(view, leave_out=["IMG_0012.jpg"])
    picture.rgb                                   # (height, width, 3) uint8
    plan = lum.plan(view)                         # photos, weights and points of every pixel
    lg.evaluate("captures/garden", holdout=8)     # figures of photos that are left out

Pixel centres lie at (i + 0.5, j + 0.5); cameras look along z, x to the right, y down; angles in settings are degrees.
"""

from __future__ import annotations

from typing import Any, Dict, Optional, Union

from . import errors
from ._core import (
    Lumigraph,
    Mesh,
    Picture,
    Plan,
    RayWeights,
    Scene,
    View,
    __version__,
    measures,
    open_scene,
    program_path,
    psnr_db,
    read_image,
    resize,
    set_threads,
    setting_options,
    threads,
    write_image,
)
from ._core import _evaluate
from .errors import BugError, CorruptInput, DataRefused, Error, Interrupted, MachineError, UsageError
from .programs import ProgressCallback, options, period, pipeline, proxy, reconstruct, run, stabilize

__all__ = [
    "BugError", "CorruptInput", "DataRefused", "Error", "Interrupted", "Lumigraph", "MachineError", "Mesh", "Picture",
    "Plan", "ProgressCallback", "RayWeights", "Scene", "UsageError", "View", "__version__", "errors", "evaluate",
    "measures", "open", "open_scene", "options", "period", "pipeline", "program_path", "proxy", "psnr_db", "read_image",
    "reconstruct", "resize", "run", "set_threads", "setting_options", "stabilize", "threads", "write_image",
]


def open(scene: Any, proxy: Union[None, str, Mesh] = None, settings: Optional[Dict[str, Any]] = None,
         effects: str = "auto", **more: Any) -> Lumigraph:
    """Opens a scene for rendering; the same as Lumigraph(...).

    proxy: a name, a mesh file, "per-view", a Mesh, or None for the active one. settings: options of the reconstruction
    (setting_options) by name, as {"k": 8, "resolution": "jacobian", "fov": False}. effects: which measures count, as
    --effects takes them. more: phase, window_frames, rescale_cameras, memory_mb, progress; along_matrices=True
    for the frames of a path of projection matrices (stabilize).
    """
    return Lumigraph(scene, proxy=proxy, settings=settings or {}, effects=effects, **more)


def evaluate(scene: Any, holdout: Union[int, str] = "auto", fold: str = "", proxy: str = "", width: int = 0,
             settings: Optional[Dict[str, Any]] = None, effects: str = "auto", backend: str = "cpu",
             progress: Optional[ProgressCallback] = None) -> Dict[str, Any]:
    """Errors of photos that are left out and rendered from the others: what lumi-render --holdout prints as JSON.

    holdout: N (photos 0, N, 2N ...), "each", or "auto". Keys: psnr_mean_db, psnr_seen_mean_db, ssim_mean, coverage,
    views[...].
    """
    return _evaluate(scene, str(holdout), fold, proxy, width, settings or {}, effects, backend, progress)
