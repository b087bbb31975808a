"""A bucket on loopback: moto's server in a process of its own, which answers some of the reads with 503 if wanted."""

from __future__ import annotations

import http.client
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any

from tests.support.processes.processes import ROOT, free_port
from tests.support.real_parts import need_module

BUCKET = "plant"


@contextmanager
def bucket(folder: Path, *, fails_every: int = 0) -> Iterator[dict[str, str]]:
    """All files of the folder in s3://plant/NAME-OF-THE-FOLDER/; the variables by which a process finds it.

    fails_every: one in so many reads of an object is answered with 503.
    """
    for name in ("flask", "moto", "s3fs"):
        need_module(name, "pip install 'combtrace[dev]'")
    port = free_port()
    command = [sys.executable, "-m", "tests.support.service.bucket_server", str(port), str(fails_every)]
    server = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=os.environ)
    try:
        assert server.stdout is not None
        assert server.stdout.readline() == b"ready\n"
        _put(port, folder)
        yield {
            "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}",
            "AWS_ACCESS_KEY_ID": "test",
            "AWS_SECRET_ACCESS_KEY": "test",
            "AWS_DEFAULT_REGION": "us-east-1",
        }
    finally:
        server.kill()
        server.communicate()


def _put(port: int, folder: Path) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", port)
    try:
        for name in ("", *(str(path.relative_to(folder.parent)) for path in folder.rglob("*") if path.is_file())):
            body = (folder.parent / name).read_bytes() if name else b""
            connection.request("PUT", f"/{BUCKET}/{name}".rstrip("/"), body)
            answer = connection.getresponse()
            answer.read()
            assert answer.status == 200, name
    finally:
        connection.close()


def _failing(app: Callable[..., Iterable[bytes]], every: int) -> Callable[..., Iterable[bytes]]:
    """The server, but for one in `every` reads of an object."""
    reads = count(1)

    def answer(request: dict[str, Any], start: Callable[..., Any]) -> Iterable[bytes]:
        of_object = request["REQUEST_METHOD"] == "GET" and request["PATH_INFO"].count("/") > 2
        if every and of_object and next(reads) % every == 0:
            start("503 Slow Down", [("Content-Type", "application/xml")])
            return [b"<Error><Code>SlowDown</Code><Message>Please reduce your request rate.</Message></Error>"]
        return app(request, start)

    return answer


def main() -> None:
    """Serve until killed."""
    from moto.server import DomainDispatcherApplication, create_backend_app
    from werkzeug.serving import make_server

    app = _failing(DomainDispatcherApplication(create_backend_app), int(sys.argv[2]))
    server = make_server("127.0.0.1", int(sys.argv[1]), app, threaded=True)
    print("ready", flush=True)
    server.serve_forever()


if __name__ == "__main__":
    main()
