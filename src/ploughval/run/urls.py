"""Places named by URL: which text is one, how it is shown, and the file system that stands behind it."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from ploughval.errors import DataError, MissingExtraError, PloughvalError

_URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+://")

_LOGIN = re.compile(r"(?P<plain>[^/?#]*)@|(?P<odd>[^/?#:]*:(?!\d+(?:[/?#]|$)).*)@", re.DOTALL)
"""User and password where the rest of a URL begins; odd ones hold signs that end them, as no URL may."""

WHOLE_OBJECTS = {"s3", "s3a", "gs", "gcs", "abfs", "abfss", "az", "oci", "oss", "memory"}
"""Protocols of stores where a file is there as a whole or not at all; others write it bit by bit."""


def is_url(place: object) -> bool:
    """Whether a place is named by a URL rather than by a path of this machine.

    >>> is_url("s3://bucket/test"), is_url("C:/tests/a"), is_url("tests/a")
    (True, False, False)
    """
    return isinstance(place, str) and _URL.match(place) is not None


def shown(place: Path | str) -> str:
    """A place as messages and records name it: a URL without user, password and query.

    >>> shown("sftp://me:secret@host/data/a?sig=x"), shown("sftp://me:a/b#c@host/d"), shown("tests/a")
    ('sftp://host/data/a', 'sftp://host/d', 'tests/a')
    """
    if not is_url(place):
        return str(place)
    protocol, _, rest = _split(str(place))
    return f"{protocol}://{rest.partition('?')[0].partition('#')[0]}".rstrip("/")


def without_secrets(text: str, *places: Path | str) -> str:
    """A text in which neither the URLs' passwords nor their queries stand.

    >>> without_secrets("login with p%40ss (p@ss) failed", "sftp://me:p%40ss@host/a")
    'login with *** (***) failed'
    """
    for place in filter(is_url, places):
        text = text.replace(str(place), shown(place))
        _, login, rest = _split(str(place))
        for secret in (rest.partition("?")[2].partition("#")[0], login.partition(":")[2]):
            for form in {secret, unquote(secret)} - {""}:
                text = text.replace(form, "***")
    return text


def _split(url: str) -> tuple[str, str, str]:
    """Protocol, user and password, and the rest of a URL."""
    protocol, _, rest = url.partition("://")
    login = _LOGIN.match(rest)
    return (protocol, "", rest) if login is None else (protocol, login[0][:-1], rest[login.end() :])


def placed(text: str) -> Path | str:
    """A place from its text: a path, or a URL as it stands, which a path would change.

    >>> placed("s3://bucket/a"), placed("a").name
    ('s3://bucket/a', 'a')
    """
    return text if is_url(text) else Path(text)


def joined(place: Path | str, name: str) -> Path | str:
    """A name inside a place of either kind.

    >>> joined("s3://bucket/out/", "a"), joined(Path("out"), "a").as_posix()
    ('s3://bucket/out/a', 'out/a')
    """
    if not is_url(place):
        return Path(place) / name
    return f"{str(place).rstrip('/')}/{name}"


def last_name(place: Path | str) -> str:
    """The last name of a place of either kind.

    >>> last_name("s3://bucket/tests/a/"), last_name("tests/a")
    ('a', 'a')
    """
    return shown(place).rpartition("/")[2] if is_url(place) else Path(place).resolve().name


def file_system(url: str) -> tuple[Any, str]:
    """The fsspec file system behind a URL, and the path in it.

    Raises
    ------
    MissingExtraError
        Where fsspec is not installed.
    DataError
        An unknown protocol, a driver that is not installed, a store that refuses.
    """
    try:
        fsspec: Any = import_module("fsspec")  # an extra: not there in a plain installation
    except ImportError:
        raise MissingExtraError("fsspec", "cluster", f"{shown(url)}:") from None
    protocol, login, _ = _split(url)
    if "::" in url or "?" in url or set("/#") & set(login) or not _is_known(fsspec, protocol):
        raise DataError(
            "names no file system; expected a plain URL of a folder, such as s3://bucket/test, gs://, "
            "abfs://, sftp:// or file://, without :: and without a query (in a password %2F for /, "
            "%3F for ?, %23 for #)",
            path=shown(url),
        )
    try:
        system, path = fsspec.core.url_to_fs(url)
    except ImportError as error:
        raise DataError(
            f"{protocol}:// needs a driver that is not installed here ({error}); install it beside ploughval",
            path=shown(url),
        ) from None
    except Exception as error:  # what drivers raise has no common root
        raise _refusal(url, error) from None
    return system, str(path).rstrip("/")


def _is_known(fsspec: Any, protocol: str) -> bool:
    return protocol in fsspec.available_protocols() or protocol in fsspec.registry


@contextmanager
def answering(url: str) -> Iterator[None]:
    """Turn whatever a driver raises into one message; a missing object stays FileNotFoundError.

    Raises
    ------
    DataError
        With the URL and the driver's own words, without secrets.
    """
    try:
        yield
    except (FileNotFoundError, PloughvalError):
        raise
    except Exception as error:  # botocore's, paramiko's and others' errors have no common root
        raise _refusal(url, error) from None


def _refusal(url: str, error: Exception) -> DataError:
    told = without_secrets(str(error), url) or "no reason given"
    return DataError(
        f"the store does not answer as it should ({type(error).__name__}: {told}); check the address, the "
        "network and the credentials, then run again: what is done stays",
        path=shown(url),
    )
