"""``rig bench precision``: error against processor time of every method on every problem."""

from argparse import Namespace
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

from rig.bench.figures import choice_figure, work_figure
from rig.bench.findings import Findings
from rig.bench.problems import problems
from rig.bench.references import own_error
from rig.bench.work import TARGETS, Point, WorkProblem, cheapest, measure
from rig.commands.output import say
from rig.text_table import text_table

_HEAD = Path(__file__).with_suffix(".md").read_text("utf-8") + "\n"


def run(arguments: Namespace) -> Iterator[Findings]:
    """Measure problem after problem; yield what there is so far."""
    study = Study()
    for problem in problems(quick=arguments.quick):
        say(f"{problem.title} …")
        study.add(problem, *measure(problem, quick=arguments.quick))
        yield study.findings()


class Study:
    """Problems, and what was measured of them."""

    def __init__(self, name: str = "precision", head: str = _HEAD) -> None:
        self._name, self._head = name, head
        self.problems: list[WorkProblem] = []
        self.points: list[Point] = []
        self.left_out: list[str] = []

    def add(self, problem: WorkProblem, points: Sequence[Point], left_out: Sequence[str]) -> None:
        """Take in what was measured of one more problem."""
        self.problems.append(problem)
        self.points += points
        self.left_out += left_out

    def findings(self, table: Sequence[str] = ()) -> Findings:
        """Return page, pictures and table; by default what to choose, with a picture of it."""
        pictures = {
            f"{self._name}-{problem.name}": work_figure(problem.title, self._of(problem))
            for problem in self.problems
        }
        head = self._head + "\n\n".join(f"![{name}]({name}.svg)" for name in pictures)
        choices = {one.title: points for one in self.problems if (points := self._choice(one))}
        record = {
            "problems": [{"name": one.name, "title": one.title} for one in self.problems],
            "points": [point._asdict() for point in self.points],
            "left_out": self.left_out,
        }
        lines = [*(table or self.table()), "", *self.remarks()]
        rows = [point.row() for point in self.points]
        picture = "" if table else choice_figure(choices)
        return Findings(record, lines, head, rows, picture, pictures)

    def _of(self, problem: WorkProblem) -> list[Point]:
        return [point for point in self.points if point.problem == problem.name]

    def _choice(self, problem: WorkProblem) -> list[Point]:
        """All settings of the method that is cheapest at the hardest target that any reaches."""
        points = self._of(problem)
        reached = [best for target in TARGETS if (best := cheapest(points, target))]
        return [point for point in points if reached and point.method == reached[-1].method]

    def table(self) -> list[str]:
        """Return the cheapest setting of each problem for each of `TARGETS`."""
        rows = [["problem", *(f"error ≤ {target:.0e}" for target in TARGETS)]]
        for problem in self.problems:
            best = [_words(cheapest(self._of(problem), target)) for target in TARGETS]
            again = ("″" if cell == last else cell for last, cell in pairwise(best))
            rows.append([problem.title, best[0], *again])
        return text_table(rows, left=range(5), rule=True)

    def remarks(self) -> Iterator[str]:
        """Say how well references are known, and what was left out."""
        known = max(own_error(one.exact, one.inputs) for one in self.problems)
        routes = dict.fromkeys(one.route for one in self.problems)
        yield f"references, known to {max(1e-50, known):.0e}: {'; '.join(routes)}"
        yield from (f"left out: {setting}" for setting in self.left_out)


def _words(point: Point | None) -> str:
    if not point:
        return "–"
    return f"{point.method}, {point.setting}: {1e3 * point.cpu_s:.3g} ms".replace(", –", "")
