"""Where a command's JSON or page goes: standard output, or a file that is whole or as it was before."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from service.atomic_file import file_mode, sync_folder
from service.cli.errors import UserError


@contextmanager
def text_output(name: str | None, option: str = "--json") -> Iterator[Callable[[str], None]]:
    """A function that takes text: nowhere for None, to standard output for `-`, else into the file of that name.

    The file is opened before any work is done, beside its place, and takes it when all went well; an error leaves what
    was there. Raises UserError where it cannot be written.
    """
    if name is None:
        yield lambda _text: None
    elif name == "-":
        yield lambda text: print(text, end="", flush=True)
    elif Path(name).exists() and not Path(name).is_file():  # a device or pipe is written to, never replaced
        yield from _straight(Path(name), option)
    else:
        yield from _replaced(Path(name), option)


def _straight(path: Path, option: str) -> Iterator[Callable[[str], None]]:
    try:
        with path.open("w", encoding="utf-8") as file:
            yield lambda text: print(text, end="", file=file, flush=True)
    except OSError as error:
        raise _cannot(option, path, error) from error


def _replaced(path: Path, option: str) -> Iterator[Callable[[str], None]]:
    target = path.resolve()
    try:
        number, beside = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    except OSError as error:
        raise _cannot(option, path, error) from error
    try:
        with open(number, "w", encoding="utf-8") as file:

            def write(text: str) -> None:
                try:
                    file.write(text)
                except OSError as error:
                    raise _cannot(option, path, error) from error

            yield write
            try:
                file.flush()
                os.fsync(number)
                os.fchmod(number, file_mode(target))
            except OSError as error:
                raise _cannot(option, path, error) from error
        os.replace(beside, target)
        with suppress(OSError):  # it is there; that it outlives a power cut is more than some file systems can say
            sync_folder(target.parent)
    finally:
        with suppress(FileNotFoundError):
            os.unlink(beside)


def _cannot(option: str, path: Path, error: OSError) -> UserError:
    return UserError(f"{option} {path}: cannot be written: {error.strerror}. Name another file")
