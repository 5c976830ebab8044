"""Compiled code on disk that no longer is that of the sources."""

import contextlib
import hashlib
import os
import tempfile
from pathlib import Path

_PACKAGE = Path(__file__).parents[1]
_STAMP = Path("__pycache__") / "kernels.sha256"


def forget_stale_code(package: Path = _PACKAGE) -> bool:
    """Delete the package's compiled kernels unless they were compiled from the kernel files as they are now.

    numba looks at the file of a kernel only, and not at those of the kernels that became part of it.  Returns whether
    anything was stale.  Where the package may not be written, numba keeps its code elsewhere and installing the package
    makes all files new.
    """
    digest = hashlib.sha256()
    for source in sorted(package.rglob("_*_kernels.py")):
        digest.update(source.relative_to(package).as_posix().encode() + b"\0" + source.read_bytes())
    stamp = package / _STAMP
    with contextlib.suppress(OSError):
        if stamp.is_file() and stamp.read_text(encoding="ascii") == digest.hexdigest():
            return False
        for kind in ("*.nbi", "*.nbc"):
            for compiled in package.rglob(f"__pycache__/{kind}"):
                compiled.unlink(missing_ok=True)
        stamp.parent.mkdir(exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=stamp.parent, delete=False, encoding="ascii") as written:
            written.write(digest.hexdigest())
        os.replace(written.name, stamp)
    return True
