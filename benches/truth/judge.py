"""Judges answers by periodic motions, and counts the verdicts."""

import collections
import time

import numpy as np

QUANTITIES = ("amplitude", "friction power", "slip", "force")
LITTLE = 1e-3  # A quantity below this share of what it is beside is not judged.
SHARE_OF_TRUTH = 0.1  # The error of the truth may be this share of what is judged.


def compared(point, truth):
    """For each quantity the relative distance of an answer from a truth and the relative error of the truth; None
    where the quantity does not exist."""
    values, errors = ({key: np.array(value, float) for key, value in truth[part].items()} for part in ("values", "errors"))
    found = {}

    def add(name, answer, key, beside):
        of = values[key]
        scale = np.abs(of).max() if len(of) else 0
        if scale > LITTLE * beside:
            found[name] = (float(np.abs(np.atleast_1d(answer) - of).max() / scale), float(errors[key].max() / scale))

    add("amplitude", point["amplitude_m"], "amplitude_m", 0)
    add("friction power", point["friction_power_w"], "friction_power_w", values["damping_w"].sum() + values["friction_power_w"].sum())
    add("slip", point["slid_m"], "slid_m", truth["size"])
    add("force", point["most_n"], "most_n", 0)
    return found


def estimate_of(point, name, accuracy):
    """Estimated error of a quantity, or the accuracy asked for where there is none."""
    estimated = (point.get("estimated") or {}).get(name)
    if estimated is None or not np.isfinite(estimated).all():
        return accuracy, False
    return max(max(estimated), 1e-4 * accuracy), True


def verdict_of(distance, truth_error, allowance):
    """right, wrong, or vague where the truth is not sharp enough to tell."""
    if distance + truth_error / SHARE_OF_TRUTH < allowance:
        return "right"
    if truth_error > SHARE_OF_TRUTH * allowance and distance - 3 * truth_error < allowance:
        return "vague"
    return "wrong" if distance > allowance else "right"


def judge(point, truths, accuracy):
    """Verdicts of a point for each quantity, by the nearest truth: `three` by three estimates, `asked` by the accuracy."""
    if not point["has_motion"]:
        return {"verdict": "no answer", "why": point["outcome"]}  # The balance does not hold.
    line = {"outcome": point["outcome"], "harmonics": point["harmonics"], "stable": point["stable"], "quantities": {}}
    if not truths:
        return {**line, "verdict": "no truth"}
    nearest = min(truths, key=lambda truth: sum(distance for distance, _ in compared(point, truth).values()))
    for name, (distance, truth_error) in compared(point, nearest).items():
        if name != "amplitude" and np.isnan(point["estimated"][name]).any():
            continue  # The force of a rigid pair that lands has no finite maximum.
        estimate, is_estimated = estimate_of(point, name, accuracy)
        line["quantities"][name] = {
            "distance": distance, "truth_error": truth_error, "estimate": estimate, "is_estimated": is_estimated,
            "three": verdict_of(distance, truth_error, 3 * estimate), "asked": verdict_of(distance, truth_error, accuracy),
        }
    sizes = nearest["largest"]
    line["multiplier"] = max(sizes)
    is_clear = abs(sizes[0] - sizes[1]) < 0.02 and all(abs(size - 1) > 1e-3 for size in sizes) and (sizes[0] > 1) == (sizes[1] > 1)
    verdict = "not judged" if point["stable"] is None else "right" if (sizes[0] < 1) == point["stable"] else "wrong"
    line["stability"] = verdict if is_clear else "vague"
    verdicts = [q["three"] for q in line["quantities"].values()]
    line["verdict"] = "wrong" if "wrong" in verdicts else "judged"
    return line


class Tally:
    """All judged points."""

    def __init__(self):
        self.lines, self.models = [], 0

    def add(self, lines):
        self.lines += lines
        self.models += 1


def rate(part, whole):
    return f"{part:5d} ({100 * part / whole:5.2f} %)" if whole else f"{part:5d}"


def report(tally, arguments):
    lines = tally.lines
    total = len(lines)
    lines.sort(key=lambda line: (line["seed"], line["hz"]))
    last = lines[-1]["seed"]
    kind = f", {arguments.kind} pairs only" if arguments.kind else ""
    print(f"{tally.models} models, seeds {arguments.seed} to {last}, accuracy {arguments.accuracy:g}{kind}, {time.strftime('%Y-%m-%d')}")
    count = collections.Counter(line["verdict"] for line in lines)
    converged = [line for line in lines if line.get("outcome") == "converged"]
    flagged = [line for line in lines if "outcome" in line and line["outcome"] != "converged"]
    print(f"points                       {total}")
    print(f"  converged                  {rate(len(converged), total)}")
    print(f"  flagged                    {rate(len(flagged), total)}   a motion whose estimate exceeds the accuracy")
    print(f"  no answer                  {rate(count['no answer'], total)}")
    print(f"  slow                       {rate(count['slow'], total)}   stopped after {arguments.most_seconds} s for each frequency")
    print(f"  without a truth            {rate(count['no truth'], total)}   no periodic motion found: not judged")
    for group, name in ((converged, "converged"), (flagged, "flagged")):
        print(f"{name:16} judged   right          beyond the accuracy   beyond three estimates   truth too vague")
        for quantity in QUANTITIES:
            found = [line["quantities"][quantity] for line in group if quantity in line.get("quantities", {})]
            vague = sum(q["three"] == "vague" for q in found)
            sharp = [q for q in found if q["three"] != "vague"]
            beyond, asked = (sum(q[by] == "wrong" for q in sharp) for by in ("three", "asked"))
            print(f"  {quantity:14} {len(sharp):6d}   {rate(len(sharp) - beyond, len(sharp))}   {rate(asked, len(sharp))}      "
                  f"{rate(beyond, len(sharp))}         {vague}")
        clear = [line for line in group if line.get("stability") in ("right", "wrong")]
        wrong = sum(line["stability"] == "wrong" for line in clear)
        unclear, without = (sum(line.get("stability") == end for line in group) for end in ("vague", "not judged"))
        print(f"  {'stability':14} {len(clear):6d}   {rate(len(clear) - wrong, len(clear))}   {rate(wrong, len(clear))}                             {unclear}   not judged by the program {without}")
    seconds = [line["seconds"] for line in lines if line["verdict"] != "slow" and line["seconds"] > 0]
    slow = [arguments.most_seconds] * count["slow"]
    if seconds:
        marks = np.percentile(seconds + slow, [50, 90, 99])
        print(f"processor time of a frequency, s: median {marks[0]:.3f}, 90 % {marks[1]:.3f}, 99 % {marks[2]:.3f}")
    for line in lines:
        for name, q in line.get("quantities", {}).items():
            if q["three"] == "wrong" and line["outcome"] == "converged":
                print(f"wrong: seed {line['seed']}, {line['hz']:.7g} Hz, {line['kind']}, {line['pairs']} pairs, H {line['harmonics']}: {name} "
                      f"off by {q['distance']:.3g}, estimated {q['estimate']:.3g}{'' if q['is_estimated'] else ' (accuracy)'}, truth {q['truth_error']:.1g}")
    for line in lines:
        if line["verdict"] in ("no answer", "slow"):
            print(f"{line['verdict']}: seed {line['seed']}, {line['hz']:.7g} Hz, {line['kind']}, {line['pairs']} pairs {line['why']}")
