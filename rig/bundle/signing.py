"""Signatures in the minisign format, by py-minisign (the extra ``sign``)."""

import os
import sys
from collections.abc import Mapping
from getpass import getpass

from minisign import Error, PublicKey, SecretKey, Signature

from rig.bundle.archive import PUBLIC_KEY, SIGNATURE, SUMS, list_hashes
from rig.bundle.contents import WRONG
from rig.files import read_input
from rig.reasons import errors_become, rig_error

_COMMENT = "rig export --bundle"
_LONGEST = 4096
"""Bytes of a key file; minisign writes fewer than 300."""


def read_secret(key: str | os.PathLike[str]) -> SecretKey:
    """Read a secret key, and ask for its password if it has one.

    Raises
    ------
    InputError
        The key cannot be used; of one with a password, that there is no terminal to ask at.
    """
    with errors_become("key_unusable", OSError, Error, path=key):
        secret = SecretKey.from_bytes(read_input(key, _LONGEST))
        if secret.is_encrypted():
            if not sys.stdin.isatty():
                raise rig_error("key_locked", path=key)
            secret.decrypt(getpass(f"password of {key}: "))
    return secret


def sign(files: Mapping[str, bytes], secret: SecretKey) -> dict[str, bytes]:
    """Add the public key and a signature of the list of hashes to the files of a bundle.

    The same files and key give the same bytes.
    """
    signed = list_hashes({**files, PUBLIC_KEY: bytes(secret.get_public_key()) + b"\n"})
    signature = secret.sign(signed[SUMS], untrusted_comment=_COMMENT, trusted_comment=_COMMENT)
    return {**signed, SIGNATURE: bytes(signature) + b"\n"}


def check_signature(files: Mapping[str, bytes], key: str | os.PathLike[str] | None) -> str:
    """Check the signature of a bundle with a public key, or with the one that is in it.

    Returns
    -------
    str
        The finding; it begins with `WRONG` unless the signature is right.

    Raises
    ------
    InputError
        The key cannot be read, or is no public key of minisign.
    """
    stated = None
    if key is not None:
        with errors_become("key_unusable", OSError, Error, path=key):
            stated = PublicKey.from_bytes(read_input(key, _LONGEST))
    try:
        public = stated or PublicKey.from_bytes(files.get(PUBLIC_KEY, b""))
        public.verify(files[SUMS], Signature.from_bytes(files.get(SIGNATURE, b"")))
    except Error as error:
        return f"{WRONG}signature ({error})"
    whose = "compare it with the signer's own" if key is None else f"of {key}"
    return f"signature: right, by the key {public.to_base64().decode()} ({whose})"
