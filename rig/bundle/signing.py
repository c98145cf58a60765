"""Signatures in the minisign format, by py-minisign (the extra ``sign``)."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from getpass import getpass
from typing import TYPE_CHECKING

from rig.bundle.archive import SUMS
from rig.errors import InputError
from rig.files import read_input
from rig.reasons import make_error

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Mapping

SIGNATURE = f"{SUMS}.minisig"
PUBLIC_KEY = f"{SUMS}.pub"
_COMMENT = "rig export --bundle"
_LONGEST = 4096
"""Bytes of a key file; minisign writes fewer than 300."""


def public_key(key: str | os.PathLike[str]) -> bytes:
    """Return the public key of a secret key, for the bundle that is to be signed.

    Raises
    ------
    InputError
        It cannot be read, or is no secret key of minisign.
    """
    with _usable(key) as content:
        from minisign import SecretKey  # noqa: PLC0415 - an extra that few need

        return bytes(SecretKey.from_bytes(content).get_public_key()) + b"\n"


def sign(sums: bytes, key: str | os.PathLike[str]) -> bytes:
    """Sign the list of hashes. The same list and key give the same signature.

    Raises
    ------
    InputError
        The key cannot be used; of one with a password, that there is no terminal to ask at.
    """
    with _usable(key) as content:
        from minisign import SecretKey  # noqa: PLC0415 - likewise

        with SecretKey.from_bytes(content) as secret:
            if secret.is_encrypted():
                if not sys.stdin.isatty():
                    raise make_error(InputError, "key_locked", path=key)
                secret.decrypt(getpass(f"password of {key}: "))
            return _text(secret.sign(sums, untrusted_comment=_COMMENT, trusted_comment=_COMMENT))


def check_signature(
    files: Mapping[str, bytes], key: str | os.PathLike[str] | None
) -> tuple[str, bool]:
    """Check the signature of a bundle with a public key, or with the one that is in it.

    Returns
    -------
    sentence, sound
        The finding, and whether nothing is wrong. A bundle without a signature is wrong only where
        a key is given.

    Raises
    ------
    InputError
        The key cannot be read, or is no public key of minisign.
    """
    if SIGNATURE not in files:
        return "signature: none", key is None and PUBLIC_KEY not in files
    try:
        from minisign import Error, PublicKey, Signature  # noqa: PLC0415 - likewise
    except ModuleNotFoundError:
        return "signature: not checked, this needs py-minisign", key is None
    try:
        if key is None:
            public = PublicKey.from_bytes(files.get(PUBLIC_KEY, b""))
        else:
            with _usable(key) as content:
                public = PublicKey.from_bytes(content)
        signature = Signature.from_bytes(files[SIGNATURE])
        public.verify(files[SUMS], signature)
    except Error as error:
        return f"signature: wrong ({error})", False
    signature.untrusted_comment = _COMMENT  # the only part that is not signed
    if _text(signature) != files[SIGNATURE]:
        return f"signature: {SIGNATURE} was altered", False
    by = public.to_base64().decode()
    whose = "compare it with the signer's own" if key is None else f"of {key}"
    return f"signature: right, by the key {by} ({whose})", True


@contextmanager
def _usable(key: str | os.PathLike[str]) -> Iterator[bytes]:
    """Provide the content of a key file; minisign's complaints about it become ours."""
    from minisign import Error  # noqa: PLC0415 - likewise

    try:
        yield read_input(key, _LONGEST)
    except (OSError, Error) as error:
        raise make_error(InputError, "key_unusable", path=key, text=error) from error


def _text(signature: object) -> bytes:
    return bytes(signature) + b"\n"  # type: ignore[call-overload, no-any-return]
