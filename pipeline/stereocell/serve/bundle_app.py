"""The application of a bundle: its files, `/bricks` and `/values`; see serve/server.py."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from starlette.applications import Starlette
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.types import ASGIApp

from stereocell.serve.access import Access, Gate
from stereocell.serve.brick_library import BrickLibrary
from stereocell.serve.brick_session import BrickEndpoint
from stereocell.serve.measured_values import VALUES_HEADER, MeasuredValues
from stereocell.serve.static_files import BundleFiles, bricks_header

if TYPE_CHECKING:
    from stereocell.live.show_source import Live


def make_app(
    bundle: Path,
    library: BrickLibrary | None,
    stage: Path | None,
    *,
    names: tuple[str, ...],
    gate: Gate | None,
    frames: tuple[str, ...] = (),
    live: "Live | None" = None,
) -> ASGIApp:
    """Return the application: the bundle's files, `/bricks` and `/values`.

    library  the bundle's brick trees; None for an application without `/bricks`
    stage    the folder of the stage beside the bundle in OUT; None for one without `/values`
    names    the host names that the application answers to, in lower case
    gate     tokens and sessions on the LAN; None if all clients of this machine have access
    frames   origins whose pages may hold the viewer in a frame
    live     a source whose first view is the bundle (see `serve.server.serve`); None if the bundle
             is finished
    """
    if live is None:
        return Access(bundle_app(bundle, library, stage), names, gate, frames)
    from stereocell.serve.live_app import LiveApp  # slow to import, and a build does not need it

    return Access(LiveApp(live, built_app), names, gate, frames)


def built_app(bundle: Path) -> ASGIApp:
    """Return the application of a bundle that lies in OUT, beside its stage."""
    out = bundle.parent
    return bundle_app(bundle, BrickLibrary(bundle, out / "bricks"), out / "stage")


def bundle_app(bundle: Path, library: BrickLibrary | None, stage: Path | None) -> ASGIApp:
    """Return the application without its checks of access; see `make_app`."""
    values = None if library is None or stage is None else MeasuredValues(library, stage)
    endpoint = None if library is None else BrickEndpoint()
    announced = ({} if endpoint is None else bricks_header()) | (
        {} if values is None else VALUES_HEADER
    )
    files = BundleFiles(bundle, announced)

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        yield
        if endpoint is not None:
            endpoint.close()

    routes: list[BaseRoute] = [Route("/{path:path}", files.answer, methods=["GET"])]
    if library is not None and endpoint is not None:
        routes.insert(0, WebSocketRoute("/bricks", partial(endpoint.talk, library=library)))
    if values is not None:
        routes.insert(0, Route("/values/{tile}/{channel}", values.answer, methods=["GET"]))
    app = Starlette(routes=routes, lifespan=lifespan)
    # A path with a line break matches no route. It shall give 404, not a redirect.
    app.router.redirect_slashes = False
    return app
