"""Says of which commit and day the figures of a script are: the first line that the script prints."""

import datetime
import json
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def line():
    """`Measured at commit 8d1d101, 2026-02-28.`; `-dirty` where files of the repository were changed."""
    words = ["git", "-C", str(ROOT), "describe", "--always", "--exclude=*", "--abbrev=7", "--dirty"]
    found = subprocess.run(words, capture_output=True, text=True, check=False).stdout.strip()
    return f"Measured at commit {found or 'unknown'}, {datetime.date.today()}."


def line_of_runs(folders):
    """The same of figures that stand in folders of runs: the commits of the programs that made them, and the last day."""
    runs = [json.loads((Path(folder) / "summary.json").read_text()) for folder in folders]
    commits = " and ".join(dict.fromkeys(run["commit"] or "unknown" for run in runs))
    return f"Measured at commit {commits}, {max(run['begun'] for run in runs).split('T')[0]}."


if __name__ == "__main__":
    print(line())
