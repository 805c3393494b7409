"""Runs a study with Snakemake on a Slurm of this machine, lets a node die meanwhile, and compares with a local run.

    make cluster-test                                 # or, after cargo build --release and tools/setup.sh cluster:
    python3 scripts/cluster_test.py [target/release/dovetail]

The cluster is that of cluster.py. Needs root. Exit code 1, with what does not hold, unless all of docs/verification.md holds.
"""

import csv
import filecmp
import json
import os
import re
import shutil
import subprocess
import sys

import cluster
from cluster import ROOT, STATE, run, wait_for

STUDY = os.path.join(ROOT, "studies/cluster.toml")
WORK = os.path.join(ROOT, "target/cluster_test")
LOCAL, REMOTE, FLOW = (os.path.join(WORK, name) for name in ("local", "remote", "flow"))
DYING, OTHER = "node2", "node1"
# The journal of a case that is worth to go on with.
JOURNAL_BYTES = 500_000
# What a run tells of itself: files, keys of summary.json, columns of table.csv. The local cases share nothing.
OF_THE_RUN = {"case.json", "log.txt", "outcome.json", "report.html", "summary.json"}
KEYS = {"begun", "program_blake3", "stages", "seconds", "processor_seconds", "peak_memory_mib", "source", "file"}
COLUMNS = {"processor_seconds", "seconds", "peak_memory_mib", "from_cache"}
faults = []


def say(text):
    print(f"cluster-test: {text}", flush=True)


def check(holds, fault):
    if not holds:
        faults.append(fault)


def snakemake(program):
    """The command of docs/how-to/cluster.md, with less time between looks."""
    limits = [f"{rule}:{limit}*attempt" for rule in ("make_piece", "run_case") for limit in ("mem_mb=1200", "runtime=10")]
    return [
        f"{ROOT}/target/venv/bin/snakemake", "--executor", "slurm", "--jobs", "8", "--slurm-requeue",
        "--slurm-status-command", "squeue", "--keep-going", "--set-resources", *limits,
        "--default-resources", "slurm_account=studies", "slurm_partition=work",
        "--slurm-init-seconds-before-status-checks", "5", "--config", f"dovetail={program}",
    ]


def name_of(comment):
    """The case or shared input of a job, from what the plugin writes: rule_run_case_wildcards_NAME."""
    return comment.strip().split("_wildcards_")[-1]


def running(node):
    """Cases that run on a node."""
    jobs = run("squeue", "--noheader", "--states", "RUNNING", "--nodelist", node, "--format", "%k").splitlines()
    return [name_of(job) for job in jobs if "run_case" in job]


def is_begun(case):
    journal = f"{REMOTE}/cases/{case}/response.journal"
    return os.path.exists(journal) and os.path.getsize(journal) > JOURNAL_BYTES


def is_complete(case):
    return os.path.exists(f"{REMOTE}/cases/{case}/outcome.json")


def on_the_cluster(program, cases):
    """Runs the workflow, and lets a node die and come back; the cases that it took with it, and those that had begun."""
    with open(f"{WORK}/snakemake.log", "w") as log:
        process = subprocess.Popen(snakemake(program), cwd=FLOW, stdin=subprocess.DEVNULL, stdout=log, stderr=log)

    def look(what, condition):
        wait_for(what, lambda: condition() or process.poll() is not None, 1800)

    look("cases on both nodes", lambda: sum(map(is_complete, cases)) > 2 and running(OTHER) and any(map(is_begun, running(DYING))))
    victims = running(DYING)
    cluster.kill(DYING)
    victims = [case for case in victims if not is_complete(case)]
    begun = [case for case in victims if is_begun(case)]
    say(f"{DYING} died with {', '.join(victims)}")
    # Its state may stay that of a node that ends a job; its cases run no more.
    look(f"the loss of {DYING}", lambda: not running(DYING) and cluster.state(DYING).endswith("*"))
    cluster.start(DYING)
    look(f"the return of {DYING}", lambda: not cluster.state(DYING).endswith("*"))
    check(process.wait(1800) == 0, f"Snakemake ended with {process.returncode}; see {WORK}/snakemake.log")
    return victims, begun


def attempts():
    """All that Slurm has on each case and shared input, in the order of time."""
    columns = ["Comment", "NodeList", "State", "Start", "End"]
    text = run("sacct", "--duplicates", "--allocations", "--parsable2", "--noheader", "--starttime", "now-1day",
               "--format", ",".join(columns))
    rows = [dict(zip(columns, line.split("|"))) for line in text.splitlines()]
    found = {}
    for row in sorted(rows, key=lambda row: row["Start"]):
        found.setdefault(name_of(row["Comment"]), []).append(row)
    return found


def check_attempts(flow, victims, begun):
    """Each case and each shared input is completed once, and nothing but the cases of the node that died is begun twice."""
    wait_for("accounts of all jobs", lambda: all(rows[-1]["End"] != "Unknown" for rows in attempts().values()))
    found = attempts()
    check(victims, "no case was lost with a node: nothing was tested")
    check(flow["pieces"], "the cases share nothing")
    for job in flow["pieces"] + flow["cases"]:
        name = job["name"]
        rows = found.get(name, [])
        say(f"{name}: " + "; ".join(f"{r['NodeList']} {r['State']} {r['Start'][11:]}-{r['End'][11:]}" for r in rows))
        *earlier, last = [(row["State"], row["NodeList"]) for row in rows] or [("NONE", "")]
        check(last[0] == "COMPLETED" and set(earlier) <= {("NODE_FAIL", DYING)}, f"{name}: not lost with {DYING} and then completed")
        check(all(a["End"] <= b["Start"] for a, b in zip(rows, rows[1:])), f"{name} ran twice at once")
        check(bool(earlier) == (name in victims), f"{name}: lost by Slurm, or by the death of {DYING}, alone")
    for case in begun:
        with open(f"{REMOTE}/cases/{case}/log.txt") as file:
            solved = re.search(r"\d+ of \d+ frequencies were solved before", file.read())
        say(f"{case}: {solved and solved[0]}")
        check(solved, f"{case} began again from its first frequency")


def without_the_run(value):
    """summary.json without what a run tells of itself."""
    if isinstance(value, dict):
        return {key: without_the_run(v) for key, v in value.items() if key not in KEYS}
    return [without_the_run(v) for v in value] if isinstance(value, list) else value


def files(folder):
    return {os.path.relpath(os.path.join(path, name), folder) for path, _, names in os.walk(folder) for name in names}


def check_results(flow):
    """The files of each case, and the table, are those of the local run."""
    for case in (job["name"] for job in flow["cases"]):
        here, there = f"{LOCAL}/cases/{case}", f"{REMOTE}/cases/{case}"
        names = files(here)
        check(names == files(there), f"{case}: other files than here")
        _, other, missing = filecmp.cmpfiles(here, there, names - OF_THE_RUN, shallow=False)
        check(not other + missing, f"{case}: {', '.join(other + missing)} differ")
        summaries = [without_the_run(json.load(open(f"{folder}/summary.json"))) for folder in (here, there)]
        check(summaries[0] == summaries[1], f"{case}: summary.json differs")
        say(f"{case}: {len(names - OF_THE_RUN)} files compared, and summary.json")
    here, there = (list(csv.DictReader(open(f"{folder}/table.csv"))) for folder in (LOCAL, REMOTE))
    shared = {job["name"] for job in flow["cases"] if job["needs"]}
    check(all(row["from_cache"] for row in there if row["case"] in shared), "a case made what it shares")
    for row in here + there:
        for column in COLUMNS:
            del row[column]
    check(here == there, "table.csv differs")


def main():
    cluster.enter()
    program = os.path.abspath(sys.argv[1] if len(sys.argv) > 1 else f"{ROOT}/target/release/dovetail")
    os.environ["XDG_CACHE_HOME"] = f"{WORK}/cache"
    shutil.rmtree(WORK, ignore_errors=True)
    os.makedirs(WORK)
    say("the local run")
    run(program, "study", STUDY, "--jobs", "2", "--out", LOCAL)
    run(program, "study", STUDY, "--export-workflow", FLOW, "--out", REMOTE)
    with open(f"{FLOW}/cases.json") as file:
        flow = json.load(file)
    cluster.up()
    victims, begun = on_the_cluster(program, [job["name"] for job in flow["cases"]])
    if not faults:
        check_attempts(flow, victims, begun)
        check_results(flow)
        again = subprocess.run(snakemake(program), cwd=FLOW, capture_output=True, text=True)
        check("Nothing to be done" in again.stdout + again.stderr, "Snakemake finds something to do a second time")
    if owner := os.environ.get("SUDO_UID"):
        run("chown", "-R", owner, WORK, STATE)
    for fault in faults:
        say(fault)
    sys.exit(1 if faults else say("ok"))


if __name__ == "__main__":
    main()
