"""Loaded by each Python that a test starts, while lines are recorded: notes those of this process.

It is found by ``PYTHONPATH`` alone; which test is at work pytest says in the environment.
"""

import os

_NAMED = os.environ.get("RIG_MUTATION_RECORD"), os.environ.get("PYTEST_CURRENT_TEST")

if all(_NAMED):
    import atexit

    from coverage import Coverage

    _target, *_sources = str(_NAMED[0]).split(os.pathsep)
    _coverage = Coverage(
        data_file=f"{_target}.children",
        data_suffix=True,
        config_file=False,
        context=str(_NAMED[1]).rpartition(" ")[0],
        include=[f"{one}/*" for one in _sources],
    )
    # In a process in which warnings are errors.
    _coverage.set_option("run:disable_warnings", ["no-data-collected", "module-not-measured"])
    _coverage.start()

    def _save() -> None:
        _coverage.stop()
        _coverage.save()

    atexit.register(_save)
