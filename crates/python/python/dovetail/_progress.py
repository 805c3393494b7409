"""Progress of a run: a bar by tqdm where it is installed, else lines on stderr."""

import sys
import time

# Least time between two lines of a loop, s.
LINE_INTERVAL_S = 5.0


def chosen(progress):
    """Callable that hears the events of a run; `None` where nothing is to be shown.

    `progress` is `True` for the bar of the package, a callable that takes each event as a
    dictionary, `False` or `None`.
    """
    if progress is None or progress is False:
        return None
    if progress is True:
        return Bar() if _has_tqdm() else Lines()
    if callable(progress):
        return progress
    raise TypeError(
        "progress has to be True, False or a function that takes an event (a dictionary)"
    )


def _has_tqdm():
    try:
        import tqdm.auto  # noqa: F401
    except ImportError:
        return False
    return True


class Bar:
    """Bar of tqdm, of a terminal or of a notebook."""

    def __init__(self):
        self.bars = []
        self.stage = ""

    def __call__(self, event):
        from tqdm.auto import tqdm

        kind = event["kind"]
        if kind == "stage_begins":
            self.stage = event["title"]
        elif kind == "loop_begins":
            bar = tqdm(total=event["steps"] or None, desc=self.stage or event["label"], leave=False)
            self.bars.append(bar)
        elif kind == "loop_expects" and self.bars:
            self.bars[-1].total = event["steps"]
        elif kind == "loop_advances" and self.bars:
            self.bars[-1].update(event["steps"])
        elif kind == "frequency" and self.bars:
            self.bars[-1].set_postfix_str(_news(event), refresh=False)
        elif kind == "loop_ends" and self.bars:
            self.bars.pop().close()
        elif kind == "warning":
            tqdm.write(f"warning: {event['text']}", file=sys.stderr)

    def close(self):
        """Removes the bars that a run left which was stopped."""
        while self.bars:
            self.bars.pop().close()


class Lines:
    """Lines on stderr: the end of each stage, warnings, and loops every few seconds."""

    def __init__(self, out=None, interval_s=LINE_INTERVAL_S):
        self.out = out
        self.interval_s = interval_s
        self.loops = []

    def __call__(self, event):
        kind = event["kind"]
        if kind == "stage_ends":
            kept = "  cache" if event["from_cache"] else ""
            self._print(f"  {event['title']:<28} {event['seconds']:8.2f} s{kept}")
        elif kind == "warning":
            self._print(f"warning: {event['text']}")
        elif kind == "loop_begins":
            self.loops.append([event["label"], event["steps"], 0, time.monotonic(), ""])
        elif kind == "loop_ends" and self.loops:
            self.loops.pop()
        elif kind == "frequency" and self.loops:
            self.loops[-1][4] = _news(event)
        elif kind == "loop_expects" and self.loops:
            self.loops[-1][1] = event["steps"]
        elif kind == "loop_advances" and self.loops:
            loop = self.loops[-1]
            loop[2] += event["steps"]
            if time.monotonic() - loop[3] >= self.interval_s:
                loop[3] = time.monotonic()
                label, steps, done, _, news = loop
                of = f" of {steps}" if steps else ""
                self._print(f"  {label}: {done}{of}; {news}")

    def _print(self, line):
        print(line, file=self.out or sys.stderr)


def _news(event):
    found = f"{event['frequency_hz']:.3f} Hz"
    if event["outcome"] == "converged" and event["amplitude_m"]:
        return f"{found}: {event['amplitude_m'][0]:.4g} m"
    return f"{found}: {event['outcome'].replace('_', ' ')}"
