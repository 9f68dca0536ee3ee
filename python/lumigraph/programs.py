"""The programs of the suite, started from Python: what finds cameras, makes proxies, finds periods and steadies films."""

from __future__ import annotations

import json
import logging
import os
import signal
import subprocess
import threading
from typing import Any, Callable, Dict, List, Optional

from . import _core
from .errors import BugError, from_code

ProgressCallback = Callable[[str, int, Optional[int], Optional[float], Optional[float]], Any]
_log = logging.getLogger("lumigraph")


def options(**values: Any) -> List[str]:
    """Options as they stand on a line: faces=500 -> --faces 500; holes=True -> --holes; a list repeats its option.

    None and False are left out.
    """
    line: List[str] = []
    for name, value in values.items():
        option = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            line.append(option)
            continue
        for one in value if isinstance(value, (list, tuple)) else [value]:
            line += [option, os.fspath(one) if isinstance(one, os.PathLike) else str(one)]
    return line


def _end(child: subprocess.Popen) -> None:
    """Asks a program to end, and ends it where it does not; its messages are read meanwhile, so that it can say them."""
    drain = threading.Thread(target=child.stderr.read, daemon=True)
    drain.start()
    for signal_number, patience_s in (signal.SIGINT, 20), (signal.SIGTERM, 5), (signal.SIGKILL, None):
        try:
            os.killpg(child.pid, signal_number)
        except ProcessLookupError:
            pass
        try:
            child.wait(patience_s)
            break
        except (subprocess.TimeoutExpired, KeyboardInterrupt):
            continue
    drain.join()


def run(program: str, *arguments: Any, progress: Optional[ProgressCallback] = None, **more: Any) -> Dict[str, Any]:
    """Starts a program of the suite, as run("lumi-proxy", "delaunay", scene), and returns its --json summary.

    Keyword arguments become options (see options). progress(task, done, total, seconds, seconds_left) is called as the
    program goes on; the times are None here. Remarks go to the logger "lumigraph". Ctrl-C ends the program, too.
    Raises what its exit code stands for (errors.Error).
    """
    words = [os.fspath(a) if isinstance(a, os.PathLike) else str(a) for a in arguments]
    command = [str(_core.program_path(program)), *words, *options(**more), "--json"]
    environment = dict(os.environ, LUMI_PROGRESS_PIPE="1")
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL,
                             env=environment, start_new_session=True)
    printed: List[bytes] = []
    reader = threading.Thread(target=lambda: printed.append(child.stdout.read()))
    reader.start()
    said = ""
    try:
        for raw in child.stderr:
            line = raw.decode(errors="replace").rstrip()
            if not line.startswith("@progress "):
                if line:
                    said = line
                    _log.info("%s", line)
                continue
            if progress is not None:
                done, total, task = line.split(" ", 3)[1:]
                progress(task, int(done), int(total) if int(total) > 0 else None, None, None)
        code = child.wait()
    except BaseException:
        # Ctrl-C, or an exception of the callback: the program removes what is half-written, and ends.
        _end(child)
        raise
    finally:
        reader.join()
        child.stdout.close()
        child.stderr.close()
    text = b"".join(printed).decode(errors="replace")
    try:
        summary = json.loads(text)
    except ValueError:
        summary = {}
    if code == 0:
        if not summary:
            raise BugError(f"{program} printed no summary")
        return summary
    error = summary.get("error", {})
    message = error.get("message") or said or f"{program} ended with exit code {code}"
    raise from_code(error.get("code", code), message, error.get("file") or "", error.get("hint") or "")


def reconstruct(photos: Any, output: Any, progress: Optional[ProgressCallback] = None, **more: Any) -> Dict[str, Any]:
    """Photos or a video -> a scene with cameras and points (lumi-reconstruct)."""
    return run("lumi-reconstruct", photos, output=output, progress=progress, **more)


def proxy(kind: str, scene: Any, progress: Optional[ProgressCallback] = None, **more: Any) -> Dict[str, Any]:
    """A proxy for a scene (lumi-proxy): kind is auto, plane, planes, box, hull, delaunay, dense, simplify ..."""
    return run("lumi-proxy", kind, scene, progress=progress, **more)


def period(video: Any, progress: Optional[ProgressCallback] = None, **more: Any) -> Dict[str, Any]:
    """The period of what repeats itself in a video (lumi-timeperiodic period): period_frames, period_sigma_frames ..."""
    return run("lumi-timeperiodic", "period", video, progress=progress, **more)


def stabilize(scene: Any, output: Any, model: str = "smooth", progress: Optional[ProgressCallback] = None,
              **more: Any) -> Dict[str, Any]:
    """A steady path for the scene of a shaky video (lumi-stabilize); Scene.path(output) reads it."""
    return run("lumi-stabilize", scene, output=output, model=model, progress=progress, **more)


def pipeline(source: Any, output: Any, progress: Optional[ProgressCallback] = None, **more: Any) -> Dict[str, Any]:
    """The whole way from photos or a video to a scene with a report (lumi-pipeline)."""
    return run("lumi-pipeline", source, output=output, progress=progress, **more)
