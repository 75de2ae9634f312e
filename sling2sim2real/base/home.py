"""A home for those who have none: a container may start with a user's number alone."""

from __future__ import annotations

import os

from sling2sim2real.base.errors import UserError


def settle() -> None:
    """Where HOME cannot be written, set it to a temporary folder: libraries keep caches there.

    Raises:
        UserError: That folder is another user's, or there is none.
    """
    if os.access(os.path.expanduser("~"), os.W_OK | os.X_OK):
        return
    import tempfile  # seldom needed, and slow

    try:
        folder = os.path.join(tempfile.gettempdir(), f"sling2sim2real-{os.getuid()}")
        os.makedirs(folder, mode=0o700, exist_ok=True)
    except OSError as error:
        raise UserError(f"set HOME to a folder that can be written ({error.strerror})") from None
    if os.lstat(folder).st_uid != os.getuid():  # compiled code of theirs would run as ours
        raise UserError(f"set HOME to a folder that can be written; {folder} is another user's")
    os.environ["HOME"] = folder
    os.environ.setdefault("USER", str(os.getuid()))  # DVC asks for a name
