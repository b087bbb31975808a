"""What a command says when it cannot go on: one line, and an exit status."""

from __future__ import annotations

EXIT_OK = 0
EXIT_FAILED = 1
EXIT_UNUSABLE = 2
EXIT_REFUSED = 3


class UserError(Exception):
    """One clear line for the person at the terminal: seen, expected, next step."""

    def __init__(self, message: str, exit_status: int = EXIT_UNUSABLE) -> None:
        super().__init__(message)
        self.exit_status = exit_status
