"""Where in a CSV file something is wrong: lines and columns behind the csv module's back."""

from typing import NoReturn

from rig.errors import InputError, Problem, RigError
from rig.reasons import error_of, make_reason, remedies

MAX_PROBLEMS = 50


def refusal(place: str, code: str, /, **values: object) -> RigError:
    """Return the refusal of an option or of a whole file, with the remedy of its code."""
    error = error_of(InputError, make_reason(code, **values))
    error.message = f"{place}: {error.message}"
    return error


class ProblemList:
    """Faults of one file; beyond the first `MAX_PROBLEMS` they are only counted.

    Parameters
    ----------
    file
        Its name.
    hint
        What to do about faults whose codes have no remedy of their own.
    """

    def __init__(self, file: str, hint: str = "") -> None:
        self.file, self.hint = file, hint
        self._problems, self._count = list[Problem](), 0

    def add(self, line: int, column: int, key: str, code: str, /, **values: object) -> None:
        """Note a fault: its place, a code of `WORDINGS` and the values of its sentence."""
        self._count += 1
        if self._count <= MAX_PROBLEMS:
            reason = make_reason(code, **values)
            self._problems.append(Problem(self.file, line, column, key, reason.text, reason=reason))

    def reject(self, line: int, column: int, key: str, text: str, accepted: str) -> None:
        """Note a value that is not what is accepted there."""
        self.add(line, column, key, "not_accepted", text=text, accepted=accepted)

    def refuse(self, line: int, code: str, /, **values: object) -> NoReturn:
        """Raise a fault of a line for which the rest is not read, with those before it."""
        self.add(line, 1, "", code, **values)
        self.raise_if_any()
        raise AssertionError

    def raise_if_any(self) -> None:
        """Raise what was noted.

        Raises
        ------
        InputError
            With all noted problems and a line that counts those left out.
        """
        if self._problems:
            message = "\n".join(map(str, self._problems))
            if more := self._count - len(self._problems):
                message += f"\n{self.file}: and {more} more problems"
            hint = "; ".join(remedies(problem.reason for problem in self._problems))
            raise InputError(message, hint or self.hint, problems=self._problems)
