"""The error of a request that the inbox refuses."""

from stereocell.model.errors import StereoCellError


class RefusedError(StereoCellError):
    """A request is refused with a status of HTTP and one line."""

    def __init__(self, status: int, line: str) -> None:
        super().__init__(line)
        self.status = status

    def __reduce__(self) -> tuple[type["RefusedError"], tuple[int, str]]:
        """Pickle both arguments: a process of the inbox's own raises it, too."""
        return type(self), (self.status, str(self))
