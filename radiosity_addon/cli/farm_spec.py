"""Who is to help with a bake, as the command line says it."""

from __future__ import annotations

from dataclasses import dataclass
from urllib.parse import urlsplit

from ..base import UsageError
from .path_checks import quoted

LOCAL = "local:"

MOST_WORKERS = 256
"""Workers on one machine."""

LOOPBACK = ("localhost", "127.0.0.1", "::1")
"""Hosts that are reached without a network."""


@dataclass(frozen=True)
class FarmSpec:
    """Workers that the bake starts: on this machine, or on a Dask cluster.

    workers: Their number on this machine.
    scheduler: The address of the cluster's scheduler.
    """

    workers: int = 0
    scheduler: str = ""


def read_farm_spec(text: str) -> FarmSpec:
    """Read who is to help. Raises UsageError if nobody can be meant."""
    if text.startswith(LOCAL):
        return FarmSpec(workers=_count(text))
    if text.startswith(("tls://", "tcp://")):
        return FarmSpec(scheduler=_scheduler(text))
    raise UsageError(f"--farm {quoted(text)}: give {LOCAL}N, such as {LOCAL}4, or tls://HOST:PORT")


def _count(text: str) -> int:
    number = text.removeprefix(LOCAL)
    workers = int(number) if number.isascii() and number.isdecimal() and len(number) < 9 else 0
    if not 1 <= workers <= MOST_WORKERS:
        raise UsageError(f"--farm {quoted(text)}: give a number of workers from 1 to {MOST_WORKERS}")
    return workers


def _scheduler(text: str) -> str:
    try:
        parts = urlsplit(text)
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    odd = any(each in "@?#" or each.isspace() or not each.isprintable() for each in text)
    if not host or not port or odd or text.count("/") > 2:
        raise UsageError(f"--farm {quoted(text)}: give the scheduler's address as tls://HOST:PORT")
    if parts.scheme == "tcp" and host not in LOOPBACK:
        raise UsageError(f"--farm {quoted(text)} is not encrypted: give tls://HOST:PORT")
    return text
