"""The truth campaign: random small models solved by the Python package, beside periodic motions that an integration in
time from event to event finds. Prints rates of right and wrong answers, and each wrong one with its seed.

    make truth
    python3 benches/truth/run.py --models 50 --accuracy 0.01 --python target/python
    python3 benches/truth/run.py --only 13          every figure of one model
    python3 benches/truth/run.py --check            the integrator against closed forms
    python3 benches/truth/run.py --write-suite      the models of the test suite

A point is one frequency of one model. It is right if it agrees with any periodic motion that was found from several
starts, the last of which is the answer itself. Truths do not depend on the solver, and are kept in target/truth.
"""

import argparse
import concurrent.futures
import hashlib
import json
import os
import pathlib
import resource
import subprocess
import sys
import time

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "RAYON_NUM_THREADS"):
    os.environ[name] = "1"

import numpy as np

import models
import motion
import periodic
from judge import Tally, judge, report

ROOT = pathlib.Path(__file__).parent.parent.parent
KEPT = motion.BUILT / "kept"


def as_numbers(value):
    if isinstance(value, dict):
        return {key: as_numbers(v) for key, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [as_numbers(v) for v in value]
    if isinstance(value, np.ndarray):
        return as_numbers(value.tolist())
    if isinstance(value, complex):
        return [value.real, value.imag]
    return value.item() if isinstance(value, np.generic) else value


def truths(model, hz, seconds, tries):
    """Periodic motions at a frequency from so many starts, kept by model and integrator."""
    text = json.dumps([model, hz, seconds, tries]) + motion.source_hash()
    path = KEPT / f"{hashlib.sha256(text.encode()).hexdigest()[:20]}.json"
    if path.exists():
        return json.loads(path.read_text())
    start = time.process_time()
    try:
        found, reasons = periodic.solutions(model, hz, tries=tries, seconds=seconds, seed=model["seed"])
    except motion.NoMotion as error:
        found, reasons = [], [str(error)]
    kept = as_numbers({"found": found, "reasons": reasons, "seconds": time.process_time() - start})
    KEPT.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(f".{os.getpid()}")
    part.write_text(json.dumps(kept))
    part.replace(path)
    return kept


def solved(model, arguments):
    """Answer of the package, or why there is none: its points, its processor time."""
    task = json.dumps({"model": model, "accuracy": arguments.accuracy, "python": arguments.python})
    limit = arguments.most_seconds * len(model["frequency_hz"])

    def limits():
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 1))

    try:
        ended = subprocess.run([sys.executable, str(pathlib.Path(__file__).parent / "solve.py")], input=task, capture_output=True,
                               text=True, preexec_fn=limits, timeout=10 * limit + 60)
    except subprocess.TimeoutExpired:
        return {"slow": True}
    if ended.returncode < 0:
        return {"slow": True}
    if ended.returncode:
        return {"error": ended.stderr.strip().splitlines()[-1]}
    return json.loads(ended.stdout)


def from_the_answer(model, hz, point, seconds):
    """Periodic motions that shooting finds from the answer."""
    force, x = (np.array(point[key][0]) + 1j * np.array(point[key][1]) for key in ("force", "x"))
    try:
        found, _ = periodic.solutions(model, hz, seconds=seconds, from_states=[periodic.started_from(hz, force, x)])
    except (motion.NoMotion, np.linalg.LinAlgError):
        return []
    return as_numbers(found)


def one(seed, arguments):
    """All points of a model, judged."""
    model = models.model(seed, arguments.kind)
    answer = solved(model, arguments)
    lines = []
    for i, hz in enumerate(model["frequency_hz"]):
        at = {"seed": seed, "kind": model["kind"], "has": model["has"], "pairs": len(model["pairs"]), "hz": hz,
              "seconds": answer.get("seconds", 0) / len(model["frequency_hz"])}
        if "points" not in answer:
            line = {"verdict": "slow" if "slow" in answer else "no answer", "why": answer.get("error", "")}
        else:
            line = one_point(model, hz, answer["points"][i], arguments)
        lines.append({**at, **line})
    return lines


def one_point(model, hz, point, arguments):
    """A point judged by the motion that comes of rest; where they differ, by that which shooting finds from the
    answer, and then by those of further starts."""
    found, reasons = [], []

    def of_starts(tries):
        kept = truths(model, hz, arguments.truth_seconds, tries)
        reasons.extend(kept["reasons"])
        return kept["found"]

    looks = [lambda: of_starts(1), lambda: from_the_answer(model, hz, point, arguments.truth_seconds), lambda: of_starts(3)]
    for look in looks if point["has_motion"] else ():
        found += look()
        line = judge(point, found, arguments.accuracy)
        if line["verdict"] == "judged":
            return line
    line = judge(point, found, arguments.accuracy)
    return {**line, "why": ", ".join(reasons)} if line["verdict"] == "no truth" else line


def show(seed, arguments):
    """Prints the answer and all truths of one model."""
    model = models.model(seed, arguments.kind)
    answer = solved(model, arguments)
    print(json.dumps(model) if arguments.json else f"seed {seed}: {model['kind']}, {len(model['pairs'])} pairs, {', '.join(model['has'])}")
    for i, hz in enumerate(model["frequency_hz"]):
        print(f"  {hz:.7g} Hz")
        found = truths(model, hz, arguments.truth_seconds, 3)
        print(f"    truths: {len(found['found'])} {found['reasons']}")
        more = []
        if "points" in answer:
            point = answer["points"][i]
            hidden = ("force", "x")
            print("    answer:", {key: value for key, value in point.items() if key not in hidden})
            if point["has_motion"]:
                more = from_the_answer(model, hz, point, arguments.truth_seconds)
                print("    judged:", judge(point, found["found"] + more, arguments.accuracy))
        else:
            print("    answer:", answer)
        for solution in found["found"] + more:
            print("    truth: ", {"multiplier": solution["largest"], **solution["values"]})
            print("      errors", solution["errors"])


def parsed():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--models", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0, help="seed of the first model")
    parser.add_argument("--accuracy", type=float, default=0.01)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--python", default=str(ROOT / "target" / "truth" / "python"), help="folder that contains the package dovetail")
    parser.add_argument("--kind", choices=models.KINDS)
    parser.add_argument("--minutes", type=float, default=600, help="no model is begun after this time")
    parser.add_argument("--most-seconds", type=int, default=10, help="processor time of a frequency above which it is slow")
    parser.add_argument("--truth-seconds", type=float, default=6, help="processor time of one search for periodic motions")
    parser.add_argument("--only", type=int, help="print all figures of this seed")
    parser.add_argument("--json", action="store_true", help="with --only: print the model itself")
    parser.add_argument("--check", action="store_true", help="hold the integrator against closed forms first")
    parser.add_argument("--write-suite", action="store_true", help="write the models of the test suite")
    return parser.parse_args()


def main():
    arguments = parsed()
    motion.compiled()
    if arguments.check:
        import check

        check.main()
        if arguments.models == 0:
            return
    if arguments.only is not None:
        show(arguments.only, arguments)
        return
    if arguments.write_suite:
        import suite

        suite.write(arguments, ROOT / "tests" / "data" / "truth" / "models.json")
        return
    tally, end = Tally(), time.monotonic() + 60 * arguments.minutes
    seeds = iter(range(arguments.seed, arguments.seed + arguments.models))
    with concurrent.futures.ProcessPoolExecutor(arguments.jobs) as pool:
        running = {pool.submit(one, seed, arguments) for _, seed in zip(range(arguments.jobs), seeds)}
        while running:
            done, running = concurrent.futures.wait(running, return_when=concurrent.futures.FIRST_COMPLETED)
            for ended in done:
                tally.add(ended.result())
                (motion.BUILT / "last.json").write_text(json.dumps(as_numbers(tally.lines)))
                if tally.models % 25 == 0:
                    print(f"{tally.models} models", file=sys.stderr, flush=True)
                # No model is begun after the time: those before it are all judged, whatever they took.
                seed = next(seeds, None) if time.monotonic() < end else None
                if seed is not None:
                    running.add(pool.submit(one, seed, arguments))
    report(tally, arguments)


if __name__ == "__main__":
    main()
