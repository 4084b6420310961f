"""The error with which the inbox refuses a request."""

from stereocell.model.errors import StereoCellError


class RefusedError(StereoCellError):
    """A request is refused, with an HTTP status and one line."""

    def __init__(self, status: int, line: str) -> None:
        super().__init__(line)
        self.status = status

    def __reduce__(self) -> tuple[type["RefusedError"], tuple[int, str]]:
        """Pickle both arguments, since the reader's process also raises this error."""
        return type(self), (self.status, str(self))
