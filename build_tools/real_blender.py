"""A real Blender for the tests that the `bpy` module cannot serve: extensions, `--command`, windows.

On Debian as root it comes from the distribution: trixie's Blender, in a folder of its own that
`chroot` enters, with a virtual screen. Everything runs in mount and process namespaces of its own,
so that neither a mount nor a process outlives the command, whatever happens to it.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from .errors import BuildError

SUITE = "trixie"
PACKAGES = ("blender", "libgl1-mesa-dri", "libegl-mesa0", "xvfb", "xauth", "imagemagick", "python3-numpy")

# Where to put the folder, for who has little room in the home folder.
FOLDER_VARIABLE = "RADIOSITY_REAL_BLENDER"

# What enters the folder. The shell stays the first process of the new namespaces: as such, xvfb-run
# would wait for ever for the signal that the screen is there.
_ENTER = """
set -e
root=$1
shift
mount -t proc proc "$root/proc"
mount --rbind /sys "$root/sys"
mount --rbind /dev "$root/dev"
chroot "$root" "$@"
"""

# Without a graphics card the shaders of a Material Preview take a minute to compile: they are kept.
SHADERS = "/var/cache/mesa"

SCREEN = "-screen 0 1280x800x24 +extension GLX"


@dataclass(frozen=True)
class RealBlender:
    """Blender in its folder `root`; files to share with it lie below `root`."""

    root: Path

    def inside(self, path: Path) -> str:
        """The name that a file below `root` has for Blender."""
        return f"/{path.relative_to(self.root)}"

    @contextmanager
    def shared_folder(self) -> Iterator[Path]:
        """An empty folder to share with Blender, deleted at the end."""
        with tempfile.TemporaryDirectory(prefix="shared-", dir=self.root / "tmp") as folder:
            yield Path(folder)

    def run(
        self,
        *arguments: str,
        resources: Path,
        window: bool = False,
        timeout: float = 300,
        environment: Mapping[str, str] | None = None,
    ) -> subprocess.CompletedProcess[str]:
        """Run `blender ARGUMENTS` and return its exit code and output (standard error included).

        Parameters
        ----------
        arguments : what follows `blender`
        resources : the user's folder (preferences, extensions), below `root`
        window : open a window on a virtual screen
        timeout : seconds until it is ended with all that it started
        environment : further variables
        """
        variables = {
            "PATH": "/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin",
            "HOME": self.inside(resources),
            "LANG": "C.UTF-8",
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "MESA_SHADER_CACHE_DIR": SHADERS,
            "BLENDER_USER_RESOURCES": self.inside(resources),
            **(environment or {}),
        }
        # Two that start at once and look for a free number from the same one on may find the same.
        first = f"--server-num={99 + os.getpid() % 400}"
        screen = ["xvfb-run", first, "--auto-servernum", f"--server-args={SCREEN}"] if window else []
        return enter(self.root, [*screen, "blender", *arguments], variables, timeout)


def default_folder() -> Path:
    """Where Blender is or will be."""
    chosen = os.environ.get(FOLDER_VARIABLE)
    return Path(chosen) if chosen else Path.home() / ".cache" / "radiosity" / SUITE


def find() -> RealBlender | None:
    """The Blender that `prepare` made, None if it has not been called here."""
    root = default_folder()
    return RealBlender(root) if _is_ready(root) and os.geteuid() == 0 else None


def prepare() -> RealBlender:
    """Install Blender (about 1.8 GB and two minutes) unless it is there already.

    Raises
    ------
    BuildError
        If this is no Debian-like machine, not root, or the installation fails.
    """
    root = default_folder()
    missing = [tool for tool in ("debootstrap", "unshare", "chroot") if not shutil.which(tool)]
    if os.geteuid() != 0 or (missing and not shutil.which("apt-get")):
        raise BuildError("a real Blender is installed by root on Debian only")
    if missing:
        raise BuildError(f"{', '.join(missing)} missing; run: apt-get install -y debootstrap util-linux")
    root.parent.mkdir(parents=True, exist_ok=True)
    with _locked(root.with_name(root.name + ".lock")):
        if not _is_ready(root):
            _install(root)
    return RealBlender(root)


def enter(
    root: Path, command: Sequence[str], variables: Mapping[str, str], timeout: float
) -> subprocess.CompletedProcess[str]:
    """Run a command inside `root`; its children end with it, and so it does at the timeout."""
    namespaces = ["unshare", "--mount", "--pid", "--fork", "--kill-child"]
    return subprocess.run(
        [*namespaces, "sh", "-c", _ENTER, "sh", str(root), *command],
        env=dict(variables),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        timeout=timeout,
        check=False,
    )


def _install(root: Path) -> None:
    if not (root / "usr" / "bin" / "apt-get").exists():
        unfinished = root.with_name(root.name + ".part")
        _remove(unfinished)
        _must(["debootstrap", "--variant=minbase", SUITE, str(unfinished)])
        _remove(root)
        unfinished.rename(root)
    install = "apt-get update -q && apt-get install -y -q --no-install-recommends " + " ".join(PACKAGES)
    variables = {"PATH": "/usr/bin:/bin:/usr/sbin:/sbin", "DEBIAN_FRONTEND": "noninteractive"}
    done = enter(root, ["sh", "-c", install], variables, timeout=1800)
    if done.returncode != 0:
        raise BuildError(f"Blender could not be installed in {root}:\n{done.stdout[-2000:]}")
    # Last, so that an interrupted installation is taken up again.
    _stamp(root).write_text(" ".join(PACKAGES))


def _remove(folder: Path) -> None:
    """Delete a folder, unless something is mounted in it: that would delete what is mounted."""
    if any(f" {folder}/" in line for line in Path("/proc/mounts").read_text().splitlines()):
        raise BuildError(f"something is mounted in {folder}; run: umount --recursive {folder}/*")
    shutil.rmtree(folder, ignore_errors=True)


def _must(command: Sequence[str]) -> None:
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if done.returncode != 0:
        raise BuildError(f"{' '.join(command)} failed:\n{done.stdout[-2000:]}")


def _is_ready(root: Path) -> bool:
    stamp = _stamp(root)
    return stamp.is_file() and stamp.read_text() == " ".join(PACKAGES)


def _stamp(root: Path) -> Path:
    return root / "radiosity-packages"


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Let one process at a time install."""
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
