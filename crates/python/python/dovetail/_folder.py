"""Reader of the folder of a finished run of the program."""

import csv
import json
import os


def read(folder):
    """Reads the folder that `dovetail run` and the commands beside it wrote.

    Returns a `Folder`. A folder without `summary.json` raises `FileNotFoundError`.
    """
    return Folder(folder)


class Folder:
    """Results of a finished run of the program, as its folder has them.

    `summary` is `summary.json` as a dictionary, whose keys docs/summary.md explains. Tables are
    dictionaries of columns, by the headings of the file: numbers as float64 (NaN where a cell is
    empty), truth values as bool, else lists of texts. `docs/output_files.md` says what each column
    is. A table that the run did not write raises `FileNotFoundError`.
    """

    def __init__(self, folder):
        self.path = os.fspath(folder)
        summary = os.path.join(self.path, "summary.json")
        if not os.path.isfile(summary):
            raise FileNotFoundError(
                f"{self.path} has no summary.json: give the folder of a run, such as output/paper"
            )
        with open(summary, encoding="utf-8") as file:
            self.summary = json.load(file)

    def __repr__(self):
        return f"<dovetail.Folder {self.path!r}: {self.state}>"

    @property
    def state(self):
        """How far the run came: `running`, `finished`, `interrupted` or `failed`."""
        return self.summary.get("state")

    @property
    def files(self):
        """Names of the tables in the folder."""
        names = (name for name in os.listdir(self.path) if name.endswith(".csv"))
        return sorted(names)

    def table(self, name):
        """Table of a file, such as `contact.csv`: a dictionary of columns."""
        path = os.path.join(self.path, name)
        if not os.path.isfile(path):
            found = ", ".join(self.files) or "none"
            raise FileNotFoundError(f"{self.path} has no {name}: its tables are {found}")
        with open(path, encoding="utf-8", newline="") as file:
            rows = list(csv.reader(file))
        if not rows:
            return {}
        heading, body = rows[0], rows[1:]
        return {name: _column([row[i] for row in body]) for i, name in enumerate(heading)}

    @property
    def response(self):
        """Response, one entry for each point, in the order of the curve."""
        return self.table("response.csv")

    @property
    def static(self):
        """Static state, one entry for each pair."""
        return self.table("static.csv")

    @property
    def contact(self):
        """Pairs at the peak and over the frequencies, one entry for each pair."""
        return self.table("contact.csv")

    @property
    def modes(self):
        """Natural frequencies, one entry for each mode."""
        return self.table("modes.csv")

    @property
    def peaks(self):
        """Peaks of `dovetail peaks`, one entry for each value."""
        return self.table("peaks.csv")

    @property
    def curve(self):
        """Motions of `dovetail curve`, one entry for each, in the order of the branches."""
        return self.table("curve.csv")

    def observed_m(self, name):
        """Complex amplitudes of an observed displacement, m, (points, H+1).

        c_k stands for the signal `real(c_k exp(i k w t))`; c_0, the mean, is not in the file and is
        NaN. Harmonics that a point does not have are 0.
        """
        import numpy as np

        response = self.response
        count = 1
        while f"{name}_h{count}_amplitude_m" in response:
            count += 1
        if count == 1:
            end = "_h1_amplitude_m"
            names = [key[: -len(end)] for key in response if key.endswith(end)]
            raise KeyError(f"no observed displacement {name!r}: there are {', '.join(names)}")
        moving = np.isfinite(response[f"{name}_amplitude_m"])
        observed = np.full((len(moving), count), np.nan, dtype=complex)
        for k in range(1, count):
            # The file has amplitude * cos(k w t - phase).
            amplitude = np.nan_to_num(response[f"{name}_h{k}_amplitude_m"])
            phase = np.nan_to_num(response[f"{name}_h{k}_phase_rad"])
            observed[moving, k] = (amplitude * np.exp(-1j * phase))[moving]
        return observed


def _column(cells):
    # Not with the module: the command `dovetail` starts without numpy.
    import numpy as np

    truths = {"true": True, "false": False}
    if cells and all(cell in truths for cell in cells):
        return np.array([truths[cell] for cell in cells])
    try:
        return np.array([float(cell) if cell else np.nan for cell in cells])
    except ValueError:
        return cells
