"""The server of the page: where it listens, what it lets in, how it ends."""

from __future__ import annotations

import asyncio
import ipaddress
import os
import re
import socket
from collections.abc import Callable, Mapping
from typing import Any

from darboux import scenario
from darboux.errors import InvalidInput

LOOPBACK = ("127.0.0.1", "localhost", "::1")
BODY = scenario.LARGEST + 20_000  # bytes of a request: a scenario and the form around it
THREADS = 6  # at least: whoever asks for a hard solve keeps one busy for seconds, and the others go on
# NiceGUI's own scripts stand in the page, and evaluate what this server sends; nothing else may be fetched or sent.
POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self'; worker-src 'self' blob:; object-src 'none'; "
    "base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)
HEADERS = (
    (b"content-security-policy", POLICY.encode()),
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"DENY"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
)
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

    app.add_middleware(Bounded)
    app.add_middleware(Guarded, host=host)

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


class Guarded:
    """Lets in only who speaks to this machine, from a page of this server; tells browsers to fetch nothing from elsewhere.

    A name of another's that leads to this machine (DNS rebinding) is refused by its Host, a foreign page's request or
    socket by its Origin.
    """

    def __init__(self, app: Any, host: str) -> None:
        self.app, self.loopback = app, host in LOOPBACK
        self.names = {*LOOPBACK, host.lower()}
        self.names |= set() if self.loopback else {socket.gethostname().lower(), socket.getfqdn().lower()}

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Pass a request on, with our headers in the answer, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        if not self._is_ours(scope["headers"]):
            if scope["type"] == "websocket":
                await send({"type": "websocket.close", "code": 1008})
                return
            from starlette.responses import PlainTextResponse

            await PlainTextResponse("Open this page by the address that darboux serve prints.", 403)(
                scope, receive, send
            )
            return

        async def headed(message: Any) -> None:
            if message["type"] == "http.response.start":
                message = message | {"headers": [*message.get("headers", ()), *HEADERS]}
            await send(message)

        await self.app(scope, receive, headed)

    def _is_ours(self, headers: Any) -> bool:
        """Return whether a request names this machine, once, and comes from no other page than ours."""
        hosts, origins = (
            [value.decode("latin-1").lower() for name, value in headers if name == wanted]
            for wanted in (b"host", b"origin")
        )
        if len(hosts) != 1:
            return False
        own = hosts[0]
        name = re.sub(r":\d*$", "", own).strip("[]") if own.count(":") < 2 or "]" in own else own
        if name not in self.names and (self.loopback or not _is_address(name)):
            return False
        return all(origin in (f"http://{own}", f"https://{own}") for origin in origins)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
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
