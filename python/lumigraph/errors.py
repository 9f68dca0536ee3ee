"""Failures, named as the programs' exit codes."""

from __future__ import annotations


class Error(Exception):
    """A failure with a reason: `message`, the `file` it is about, and a `hint` what to try (empty: none)."""

    code = 5

    def __init__(self, message: str, file: str = "", hint: str = "") -> None:
        super().__init__(message)
        self.message, self.file, self.hint = message, file, hint

    def __str__(self) -> str:
        text = f"{self.file}: {self.message}" if self.file else self.message
        return f"{text} ({self.hint})" if self.hint else text


class DataRefused(Error):
    """1: the data do not allow it."""

    code = 1


class UsageError(Error, ValueError):
    """2: wrong usage."""

    code = 2


class CorruptInput(Error):
    """3: an input that cannot be read, or is corrupt."""

    code = 3


class MachineError(Error):
    """4: the machine does not allow it: disk full, no OpenGL, COLMAP missing."""

    code = 4


class BugError(Error):
    """5: a bug of ours."""

    code = 5


class Interrupted(Error):
    """130: somebody asked to stop."""

    code = 130


_CLASSES = {c.code: c for c in (DataRefused, UsageError, CorruptInput, MachineError, BugError, Interrupted)}


def from_code(code: int, message: str, file: str = "", hint: str = "") -> Error:
    """The exception that stands for an exit code."""
    return _CLASSES.get(code, BugError)(message, file, hint)
