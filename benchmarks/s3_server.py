"""A server of S3 on this machine, which may refuse requests and cut off what is read."""

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from threading import Lock, Thread
from typing import Any
from unittest.mock import patch
from urllib.request import Request, urlopen

BUCKET = "drives"

REFUSAL = b"<Error><Code>SlowDown</Code><Message>Please reduce your request rate.</Message></Error>"


@dataclass
class Faults:
    """Faults of requests.

    Attributes:
        refuse: Each so manieth request is refused as too fast; 0 for none.
        cut: Each so manieth read ends at its half; 0 for none.
        requests: Number of requests so far.
        reads: Number of reads of objects so far.
    """

    refuse: int = 0
    cut: int = 0
    requests: int = 0
    reads: int = 0
    _lock: Lock = field(default_factory=Lock)

    def next(self, is_read: bool) -> tuple[bool, bool]:
        """Draws whether the next request is refused, and whether its read is cut off."""
        with self._lock:
            self.requests += 1
            self.reads += is_read
            refused = self.refuse > 0 and self.requests % self.refuse == 0
            return refused, is_read and self.cut > 0 and self.reads % self.cut == 0


@contextmanager
def s3_server(faults: Faults | None = None) -> Iterator[str]:
    """Runs a server with an empty bucket ``drives``, to which this process has the credentials.

    Args:
        faults: What goes wrong; None for nothing.

    Yields:
        URL of the server.
    """
    from moto.server import DomainDispatcherApplication, create_backend_app
    from werkzeug.serving import WSGIRequestHandler, make_server

    class Silent(WSGIRequestHandler):
        def log(self, *_: object) -> None:
            """Prints nothing of a request."""

    app = _failing(DomainDispatcherApplication(create_backend_app), faults or Faults())
    server = make_server("127.0.0.1", 0, app, threaded=True, request_handler=Silent)
    thread = Thread(target=server.serve_forever, daemon=True)
    thread.start()
    url = f"http://127.0.0.1:{server.server_port}"
    access = {
        "AWS_ENDPOINT_URL": url,
        "AWS_ACCESS_KEY_ID": "reader",
        "AWS_SECRET_ACCESS_KEY": "not-to-be-printed",
        "AWS_DEFAULT_REGION": "us-east-1",
    }
    try:
        # What an earlier server of this process held.
        with urlopen(Request(f"{url}/moto-api/reset", method="POST")):
            pass
        with patch.dict(os.environ, access):
            file_system().mkdir(BUCKET)
            yield url
    finally:
        server.shutdown()
        thread.join()


def file_system() -> Any:
    """The file system of the server that runs."""
    import s3fs

    # Those of an earlier server are kept by fsspec.
    s3fs.S3FileSystem.clear_instance_cache()
    return s3fs.S3FileSystem(use_listings_cache=False)


Respond = Callable[[str, list[tuple[str, str]]], Any]
Application = Callable[[dict[str, Any], Respond], Iterable[bytes]]


def _failing(app: Application, faults: Faults) -> Application:
    def failing(environ: dict[str, Any], respond: Respond) -> Iterable[bytes]:
        of_object = environ["PATH_INFO"].strip("/").count("/") > 0
        refused, cut = faults.next(environ["REQUEST_METHOD"] == "GET" and of_object)
        if refused:
            environ["wsgi.input"].read(int(environ.get("CONTENT_LENGTH") or 0))
            respond("503 Slow Down", [("Content-Type", "application/xml")])
            return [REFUSAL]
        return _cut_off(app, environ, respond) if cut else app(environ, respond)

    return failing


def _cut_off(app: Application, environ: dict[str, Any], respond: Respond) -> list[bytes]:
    """Half of a response, as if it were the whole one."""
    answered: list[Any] = []

    def hold(status: str, headers: list[tuple[str, str]], *_: object) -> None:
        answered[:] = [status, headers]

    body = b"".join(app(environ, hold))
    half = body[: len(body) // 2]
    status, headers = answered
    kept = [(name, value) for name, value in headers if name.lower() != "content-length"]
    respond(status, [*kept, ("Content-Length", str(len(half)))])
    return [half]
