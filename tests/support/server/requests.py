"""One request to a server of this machine."""

import http.client

from stereocell.serve.server import LOCALHOST
from support.server.timeouts import PATIENCE_S


def ask(
    port: int, path: str, method: str = "GET", **headers: str
) -> tuple[http.client.HTTPResponse, bytes]:
    connection = http.client.HTTPConnection(LOCALHOST, port, timeout=PATIENCE_S)
    try:
        connection.request(method, path, headers=headers)
        response = connection.getresponse()
        return response, response.read()
    finally:
        connection.close()
