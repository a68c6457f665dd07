"""The server of the page: where it listens, what it lets in, how it ends."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Callable, Mapping
from typing import Any

from darboux import scenario
from darboux.errors import InvalidInput

LOOPBACK = ("127.0.0.1", "localhost", "::1")
BODY = scenario.LARGEST + 20_000  # bytes of a request: a scenario and the form around it
THREADS = 6  # at least: whoever asks for a hard solve keeps one busy for seconds, and the others go on
HISTORY = 60  # messages kept for a browser that was cut off for a moment


def free_port(host: str, port: int) -> int:
    """Return the port, or a free one for 0. Raises ``InvalidInput`` where it is taken or the host is not this machine's."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind((host, port))
        except OSError as error:
            raise InvalidInput(
                f"port {port} of {host} can't be had ({error.strerror or error}); choose another, as in "
                f"--port {(port or 8080) + 1}."
            ) from None
        except OverflowError:
            raise InvalidInput(f"port is {port}; it must lie between 0 and 65535.") from None
        return int(trial.getsockname()[1])


def serve(shelf: Mapping[str, Any], host: str, port: int, ready: Callable[[str], None]) -> None:
    """Serve the page until Ctrl-C; ``ready`` is called with its address when it can be opened."""
    os.environ.setdefault("MPLBACKEND", "Agg")
    from nicegui import app, background_tasks, ui
    from starlette.middleware.trustedhost import TrustedHostMiddleware

    from darboux.web.page import Page
    from darboux.web.workers import Workers

    port = free_port(host, port)
    workers = Workers(max(THREADS, os.cpu_count() or 1))
    address = (
        f"http://{f'[{host}]' if ':' in host else 'localhost' if host in ('127.0.0.1', '0.0.0.0') else host}:{port}"
    )

    @ui.page("/", title="darboux: a rod", dark=None)
    def page() -> None:
        client = ui.context.client
        Page(client, shelf, workers, dict(client.request.query_params))

    if host in LOOPBACK:  # a page elsewhere can't reach this one by a name of its own
        app.add_middleware(TrustedHostMiddleware, allowed_hosts=[*LOOPBACK, "[::1]"])
    app.add_middleware(Bounded)

    async def announced() -> None:
        while not await _open(host, port):
            await asyncio.sleep(0.02)
        ready(address)

    app.on_startup(lambda: background_tasks.create(announced()))
    workers.submit(_warm, next(iter(shelf.values())).scenario.problem)
    ui.run(
        host=host,
        port=port,
        title="darboux",
        tailwind=False,
        reload=False,
        show=False,
        show_welcome_message=False,
        message_history_length=HISTORY,
        uvicorn_logging_level="error",
        timeout_graceful_shutdown=1,
    )


async def _open(host: str, port: int) -> bool:
    """Return whether the server answers yet."""
    try:
        _, writer = await asyncio.open_connection(host, port)
    except OSError:
        return False
    writer.close()
    return True


class Bounded:
    """Refuses requests whose body is longer than a scenario can be, before they are kept anywhere."""

    def __init__(self, app: Any) -> None:
        self.app = app

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Pass a request on while its body is short."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        from starlette.responses import PlainTextResponse

        headers = dict(scope["headers"])
        stated = headers.get(b"content-length", b"0")
        refusal = PlainTextResponse(f"A scenario has at most {scenario.LARGEST // 1000} kB.", status_code=413)
        if not stated.isdigit() or int(stated) > BODY:
            await refusal(scope, receive, send)
            return
        came = 0

        async def counted() -> Any:
            nonlocal came
            message = await receive()
            came += len(message.get("body", b""))
            if came > BODY:
                return {"type": "http.disconnect"}
            return message

        await self.app(scope, counted, send)


def _warm(problem: Any) -> None:
    """Load the solver's machine code while the visitor opens a browser."""
    from darboux.statics.solve import solve

    solve(problem, throw=False)
