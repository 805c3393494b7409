"""Says of which commit and day the figures of a script are: the first line that the script prints."""

import datetime
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def line():
    """`Measured at commit 8d1d101, 2026-02-28.`; `-dirty` where files of the repository were changed."""
    words = ["git", "-C", str(ROOT), "describe", "--always", "--exclude=*", "--abbrev=7", "--dirty"]
    found = subprocess.run(words, capture_output=True, text=True, check=False).stdout.strip()
    return f"Measured at commit {found or 'unknown'}, {datetime.date.today()}."


if __name__ == "__main__":
    print(line())
