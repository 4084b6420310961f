"""Read the messages of one client; check each against the schema and its kind's limits."""

from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from stereocell.formats.brick_stream import BrickFormatError, parse_message
from stereocell.serve.limits import ACKS_PER_S, MESSAGE_BYTES, MESSAGES_PER_S, Bucket, Refusal


class MessageReader:
    """Reads the messages of a client's websocket."""

    def __init__(self, socket: WebSocket) -> None:
        self._socket = socket
        self._messages = Bucket(MESSAGES_PER_S)
        self._acks = Bucket(ACKS_PER_S)

    async def read(self) -> dict[str, Any]:
        """Return the next message. Raises Refusal, and WebSocketDisconnect if the client left."""
        event = await self._socket.receive()
        if event["type"] != "websocket.receive":
            raise WebSocketDisconnect(event.get("code", 1006), event.get("reason"))
        text = event.get("text")
        if text is None:
            raise Refusal(1003, "a client may send text only, not binary frames")
        if len(text) > MESSAGE_BYTES:
            raise Refusal(1009, f"a message of more than {MESSAGE_BYTES} bytes")
        try:
            message = parse_message(text)
        except BrickFormatError as error:
            raise Refusal(1007, str(error)) from None
        bucket = self._acks if message["type"] == "ack" else self._messages
        if not bucket.take():
            raise Refusal(1008, f"more than {bucket.per_s} messages a second")
        return message
