"""Writes the models of the test suite: small ones of all kinds whose truth is sharp, one frequency each."""

import collections
import json

import models

MODELS = 30
MOST_PAIRS, MOST_POINTS, MOST_SECONDS = 3, 4, 0.4
SHARP = 1e-3


def kind_of(model, solution):
    """What a model is an example of: rigid or elastic, and whether pairs open at times, slip or stick, or no pair
    ever touches."""
    if not any(solution["touches"]):
        return model["kind"], "apart"
    does = "opens" if any(opens and touches for opens, touches in zip(solution["opens"], solution["touches"])) else "slips" if any(solution["slips"]) else "sticks"
    return model["kind"], does


WANTED = {("elastic", "opens"): 9, ("elastic", "slips"): 13, ("elastic", "sticks"): 2, ("rigid", "slips"): 4, ("rigid", "apart"): 2}


def is_sharp(solution):
    def relative(name):
        scale = max(abs(v) for v in solution["values"][name])
        return max(solution["errors"][name]) / scale if scale else 0.0

    return all(relative(name) < SHARP for name in ("amplitude_m", "friction_power_w", "slid_m", "most_n"))


def chosen(arguments):
    """Models with their truths, from the seeds in their order."""
    from run import solved, truths
    from judge import judge

    left, features = collections.Counter(WANTED), collections.Counter()
    seed = arguments.seed
    while sum(left.values()) and seed < arguments.seed + arguments.models:
        model = models.model(seed)
        seed += 1
        if len(model["pairs"]) > MOST_PAIRS or len(model["K"]) > 3 * MOST_POINTS or not any(
                n > 0 for (kind, _), n in left.items() if kind == model["kind"]):
            continue
        for hz in model["frequency_hz"][:2]:
            one = {**model, "frequency_hz": [hz]}
            answer = solved(one, arguments)
            if "points" not in answer or answer["seconds"] > MOST_SECONDS or answer["points"][0]["outcome"] != "converged":
                continue
            # The truth of what seems to be of a kind that is wanted.
            status = set(answer["points"][0]["status"])
            seems = "apart" if status == {"open"} else "opens" if status & {"opening", "closing"} else "slips" if "slipping" in status else "sticks"
            if left[model["kind"], seems] <= 0:
                continue
            found = truths(model, hz, arguments.truth_seconds, 1)["found"]
            if len(found) != 1 or not is_sharp(found[0]) or left[kind_of(model, found[0])] <= 0:
                continue
            quantities = judge(answer["points"][0], found, arguments.accuracy)["quantities"]
            compared = ["amplitude", "friction power"] + ["force"] * (seems != "opens")
            if any(quantities[name]["three"] != "right" for name in compared if name in quantities):
                continue
            left[kind_of(model, found[0])] -= 1
            features.update(model["has"])
            yield one, found[0]
            break
    print("not found:", {"/".join(kind): n for kind, n in left.items() if n > 0}, "features:", dict(features))


def write(arguments, path):
    """One model a line, so that a change of one is a change of one line."""
    lines = []
    for model, truth in chosen(arguments):
        names = ("amplitude_m", "friction_power_w", "most_n")
        damping_w = truth["values"]["damping_w"][0]
        model["truth"] = {name: [float(f"{v:.8g}") for v in truth["values"][name]] for name in names}
        model["truth_error"] = {name: [float(f"{v:.2g}") for v in truth["errors"][name]] for name in names}
        model["truth"]["damping_w"], model["truth"]["largest_multiplier"] = float(f"{damping_w:.8g}"), float(f"{truth['largest'][0]:.5g}")
        model["does"] = kind_of(model, truth)[1]
        del model["has"]
        size = range(len(model["K"]))
        model["K"] = [float(f"{model['K'][i][j]:.9g}") for i in size for j in range(i + 1)]
        model["M"] = [model["M"][i][i] for i in size]
        lines.append(json.dumps(model, separators=(",", ":")))
        print(f"seed {model['seed']}: {model['kind']} {model['does']}", flush=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("[\n" + ",\n".join(lines) + "\n]\n")
