"""The exceptions: one family under `TexforgeError`, each also the builtin that fits."""

from __future__ import annotations

import errno
from typing import Any, ClassVar

__all__ = [
    "AccessError",
    "Cancelled",
    "DocumentError",
    "FileError",
    "FormatError",
    "InternalError",
    "MissingFileError",
    "NoStructureError",
    "OutOfMemory",
    "OutputExistsError",
    "ParameterError",
    "PictureError",
    "ReadError",
    "SameFileError",
    "TexforgeError",
]


class TexforgeError(Exception):
    """Everything that texforge raises on purpose.

    Attributes
    ----------
    kind : str
        Stable name for programs, such as ``"too_small"``.
    message : str
        One sentence for people: what is wrong, and what to do.
    fields : dict
        The parts of the message by name, such as ``{"need": 11}``; depends on `kind`.
    """

    default_kind: ClassVar[str] = "internal"

    kind: str
    message: str
    fields: dict[str, Any]

    def __init__(
        self, message: str, *, kind: str | None = None, fields: dict[str, Any] | None = None
    ) -> None:
        super().__init__(message)
        self.message = message
        self.kind = kind or self.default_kind
        self.fields = dict(fields or {})

    def __str__(self) -> str:
        """Return the message."""
        return self.message

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle, so that worker processes can report it."""
        return _rebuilt, (type(self), self.message, self.kind, self.fields)


class ParameterError(TexforgeError, ValueError):
    """An argument is outside its range or contradicts another."""

    default_kind = "parameter"


class PictureError(TexforgeError, ValueError):
    """A picture, mask or map cannot be used as it is."""

    default_kind = "bad_picture"


class NoStructureError(TexforgeError, ValueError):
    """The picture lacks the structure that is asked for: it does not repeat, say."""

    default_kind = "no_structure"


class DocumentError(TexforgeError, ValueError):
    """The document of a procedural texture is damaged or of a later version."""

    default_kind = "document"


class OutOfMemory(TexforgeError, MemoryError):
    """The work would not fit into memory; checked before anything is allocated."""

    default_kind = "memory"


class FileError(TexforgeError, OSError):
    """A file cannot be read or written."""

    default_kind = "io"

    def __init__(
        self, message: str, *, kind: str | None = None, fields: dict[str, Any] | None = None
    ) -> None:
        super().__init__(message, kind=kind, fields=fields)
        self.errno = self.fields.get("errno")
        path = self.fields.get("path")
        self.filename = None if path is None else str(path)


class MissingFileError(FileError, FileNotFoundError):
    """The file or its folder does not exist."""


class AccessError(FileError, PermissionError):
    """The operating system does not allow it."""


class OutputExistsError(FileError, FileExistsError):
    """The output exists already, and overwriting was not asked for."""

    default_kind = "exists"


class SameFileError(FileError):
    """Output and input are the same file."""

    default_kind = "same_file"


class ReadError(FileError):
    """A file is damaged, or is not what its name or its header says."""

    default_kind = "decode"


class FormatError(FileError):
    """A file format is unknown or cannot hold the picture."""

    default_kind = "format"


class Cancelled(TexforgeError):
    """The progress callback returned False."""

    default_kind = "cancelled"


class InternalError(TexforgeError, RuntimeError):
    """A bug of texforge."""

    default_kind = "internal"


_CLASSES: dict[str, type[TexforgeError]] = {
    "parameter": ParameterError,
    "too_small": PictureError,
    "empty_mask": PictureError,
    "not_finite": PictureError,
    "size_mismatch": PictureError,
    "bad_picture": PictureError,
    "no_structure": NoStructureError,
    "document": DocumentError,
    "memory": OutOfMemory,
    "decode": ReadError,
    "format": FormatError,
    "io": FileError,
    "exists": OutputExistsError,
    "same_file": SameFileError,
    "cancelled": Cancelled,
    "internal": InternalError,
}

_IO_CLASSES: dict[int | None, type[FileError]] = {
    errno.ENOENT: MissingFileError,
    errno.EACCES: AccessError,
    errno.EPERM: AccessError,
    errno.EROFS: AccessError,
    errno.EEXIST: OutputExistsError,
}


def from_core(kind: str, message: str, fields: dict[str, Any]) -> TexforgeError:
    """Return the exception for an error of the Rust core, which calls this."""
    cls = _CLASSES.get(kind, InternalError)
    if cls is FileError:
        cls = _IO_CLASSES.get(fields.get("errno"), FileError)
    return cls(message, kind=kind, fields=fields)


def _rebuilt(
    cls: type[TexforgeError], message: str, kind: str, fields: dict[str, Any]
) -> TexforgeError:
    return cls(message, kind=kind, fields=fields)
