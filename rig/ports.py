"""Port URLs: which of them are simulations, and what a simulation needs to be told."""

from pathlib import Path
from urllib.parse import SplitResult, parse_qsl, urlencode, urlsplit

from rig.reasons import errors_become, rig_error

_SIMULATED = {"sim": "seed=3", "emu": "board=mega"}
"""URL schemes behind which no real chain falls, each with an example of a setting."""
_BYTES = "surrogateescape"  # a file's name need not be UTF-8
_FILES = {"protocol", "truth"}


def is_simulated(url: str) -> bool:
    """Whether data from this port must be stamped as simulated."""
    return _split(url).scheme in _SIMULATED


def fill_url(url: str, protocol: Path, session: Path, seed: int | None, before: str = "") -> str:
    """Tell a simulation its scene, seed and where to keep the hidden truth.

    Parameters
    ----------
    url
        As the user wrote it; whatever it says stays. A real port comes back as it is.
    protocol
        The protocol file.
    session
        The session file; the truth is kept beside it.
    seed
        `None` for 0.
    before
        What `told` gave for a session that is continued: its rig and chains stay the same, and
        so does every dial that the user does not turn.

    Raises
    ------
    InputError
        No URL, or one that asks for other chains than `before`.
    """
    if not is_simulated(url):
        return url
    settings = read_settings(url)
    if seed is not None:
        settings["seed"] = str(seed)
    if _split(before).scheme == _split(url).scheme:
        earlier = read_settings(before)
        seed_before = earlier.get("seed", "0")
        if (new := settings.get("seed", seed_before)) != seed_before:
            raise rig_error("seed_differs", path=session, before=seed_before, seed=new)
        settings = earlier | settings
    places = {"protocol": str(protocol.resolve()), "truth": str(truth_file(session))}
    return _with_settings(url, settings, **places, seed="0")


def add_settings(url: str, **settings: str) -> str:
    """Add those settings to a simulation's URL that it lacks; a real port comes back as it is."""
    if not is_simulated(url):
        return url
    return _with_settings(url, read_settings(url), **settings)


def check_name(url: str) -> None:
    """See that a simulation's URL has nothing but settings: a name in it would mean nothing.

    Raises
    ------
    InputError
        Something stands before the ``?`` or behind a ``#``.
    """
    parts = _split(url)
    extra = parts.netloc + parts.path or (parts.fragment and f"#{parts.fragment}")
    if extra and parts.scheme in _SIMULATED:
        example = f"{parts.scheme}://?{_SIMULATED[parts.scheme]}"
        raise rig_error("url_unexpected", url=url, extra=extra, example=example)


def read_settings(url: str) -> dict[str, str]:
    """Take apart what a simulation's URL says behind the ``?``.

    Raises
    ------
    InputError
        A setting that is given twice, or see `check_name`.
    """
    check_name(url)
    parts, settings = _split(url), dict[str, str]()
    for name, text in parse_qsl(parts.query, keep_blank_values=True, errors=_BYTES):
        if name in settings:
            raise rig_error("setting_repeated", scheme=parts.scheme, name=name)
        settings[name] = text
    return settings


def told(url: str) -> str:
    """Return a port's URL for the record: a simulation's without the names of files."""
    if not is_simulated(url):
        return url
    settings = {name: text for name, text in read_settings(url).items() if name not in _FILES}
    return _with_settings(url, settings)


def truth_file(session: Path) -> Path:
    """Where a simulation keeps the truth of a session."""
    return Path(f"{session}.truth.jsonl")  # with_name would not take a folder's root


def _split(url: str) -> SplitResult:
    with errors_become("not_a_port", ValueError, port=url):
        return urlsplit(url)


def _with_settings(url: str, settings: dict[str, str], **usual: str) -> str:
    """Write a URL with other settings, and what they lack of the usual ones behind them."""
    query = urlencode({**settings, **usual, **settings}, errors=_BYTES)
    return f"{_split(url).scheme}://?{query}"
