"""Runs a study with Snakemake on a Slurm of this machine, lets a node die meanwhile, and compares with a local run.

    make cluster-test                                 # or, after cargo build --release and tools/setup.sh cluster:
    python3 scripts/cluster_test.py [--program target/release/dovetail]

The cluster is that of cluster.py. Needs root. Exit code 1 when anything of this does not hold:

- Snakemake ends with 0, and a second time finds nothing to do;
- every case has an outcome with exit code 0, and Slurm completed each exactly once;
- each mesh and each reduced model that cases share was made once, by a job of its own, and no case made one;
- the dead node took at least one running case with it, which ran again, went on where it was, and never ran twice at once;
- the node ran cases before its death and after its return;
- the files of each case and the table are those of the local run, byte for byte, but for times, memory and paths.

With --keep-nodes no node dies, and the test fails. With --other-processor the node that dies says that it has another
processor: its cases then begin again from their first frequency elsewhere.
"""

import argparse
import csv
import filecmp
import json
import os
import re
import shutil
import subprocess
import sys
import time

import cluster
from cluster import ROOT, STATE, Cluster, ClusterError, run, wait_for

STUDY = os.path.join(ROOT, "studies/cluster.toml")
WORK = os.path.join(ROOT, "target/cluster_test")
LOCAL, REMOTE, FLOW = (os.path.join(WORK, name) for name in ("local", "remote", "flow"))
SNAKEMAKE = os.path.join(ROOT, "target/venv/bin/snakemake")
DYING = "node2"
TIME_LIMIT_S = 1800
# The journal of a case that is worth to go on with.
JOURNAL_BYTES = 500_000
# What a run tells of itself: files, keys of summary.json, columns of table.csv. Here each case makes all of its stages.
OF_THE_RUN = {"case.json", "log.txt", "outcome.json", "report.html", "summary.json"}
KEYS = {"stages", "seconds", "processor_seconds", "peak_memory_mib", "source", "file"}
SHARED = {"finite_elements", "reduction"}
COLUMNS = {"processor_seconds", "seconds", "peak_memory_mib", "from_cache"}


def snakemake(program, *options):
    """The command of docs/how-to/cluster.md, with less time between looks."""
    return [
        SNAKEMAKE, "--executor", "slurm", "--jobs", "8", "--slurm-requeue", "--slurm-status-command", "squeue",
        "--keep-going",
        "--default-resources", "slurm_account=studies", "slurm_partition=work",
        "--set-resources", *(f"{rule}:{limit}*attempt" for rule in ("make_piece", "run_case")
                             for limit in ("mem_mb=1200", "runtime=10")),
        "--slurm-init-seconds-before-status-checks", "5", "--config", f"dovetail={program}", *options,
    ]


def case_of(comment):
    """What the plugin writes of a job: rule_run_case_wildcards_NAME."""
    return comment.split("_wildcards_", 1)[1] if "_wildcards_" in comment else comment.removeprefix("rule_")


def running(node):
    """Cases that run on a node."""
    jobs = run("squeue", "--noheader", "--states", "RUNNING", "--nodelist", node, "--format", "%k").split("\n")
    return [case_of(job.strip()) for job in jobs if job.strip() and "run_case" in job]


def journal_bytes(case):
    try:
        return os.path.getsize(f"{REMOTE}/cases/{case}/response.journal")
    except FileNotFoundError:
        return 0


def is_complete(case):
    return os.path.exists(f"{REMOTE}/cases/{case}/outcome.json")


def processes():
    """Cases whose program runs, once for each: the processes of all nodes are seen from here."""
    found = []
    for entry in os.listdir("/proc"):
        try:
            with open(f"/proc/{entry}/cmdline", "rb") as file:
                words = file.read().decode().split("\0")
        except (OSError, UnicodeDecodeError):
            continue
        if len(words) > 2 and words[1] == "run" and "--until-stdin-ends" in words:
            found.append(os.path.basename(words[words.index("--out") + 1]))
    return found


class Watch:
    """Snakemake on the cluster, looked at until it ends."""

    def __init__(self, command):
        self.log = open(f"{WORK}/snakemake.log", "w")
        environment = {**os.environ, "XDG_CACHE_HOME": f"{WORK}/cache"}
        self.process = subprocess.Popen(
            command, cwd=FLOW, env=environment, stdin=subprocess.DEVNULL, stdout=self.log, stderr=subprocess.STDOUT
        )
        self.end = time.monotonic() + TIME_LIMIT_S
        self.doubled = set()

    def until(self, what, condition):
        """Looks on until `condition` is true; Snakemake must not end before."""
        while not condition():
            if self.look() is not None:
                raise ClusterError(f"Snakemake ended with {self.process.returncode} before {what}; see {WORK}/snakemake.log")

    def look(self):
        """The exit code of Snakemake, once it has one."""
        if time.monotonic() > self.end:
            raise ClusterError(f"Snakemake did not end within {TIME_LIMIT_S} s; see {WORK}/snakemake.log")
        cases = processes()
        self.doubled |= {case for case in cases if cases.count(case) > 1}
        time.sleep(0.3)
        return self.process.poll()


def say(text):
    print(f"cluster-test: {text}", flush=True)


def on_the_cluster(machines, program, keeps_nodes, processor):
    """Runs the workflow; gives what was seen, and the faults."""
    watch = Watch(snakemake(program))
    other = next(node for node in cluster.NODES if node != DYING)

    def is_time():
        on_dying = running(DYING)
        done = sum(map(is_complete, os.listdir(f"{REMOTE}/cases"))) if os.path.isdir(f"{REMOTE}/cases") else 0
        return done > 2 and running(other) and any(journal_bytes(case) > JOURNAL_BYTES for case in on_dying)

    watch.until("cases ran on both nodes", is_time)
    victims, resumable = running(DYING), []
    if keeps_nodes:
        say(f"{DYING} stays, with {', '.join(victims)}")
    else:
        machines.kill(DYING)
        victims = [case for case in victims if not is_complete(case)]
        resumable = [case for case in victims if journal_bytes(case) > JOURNAL_BYTES]
        say(f"{DYING} died with {', '.join(victims)}")
        begin = time.monotonic()
        # Its state may stay that of a node that ends a job; its cases run no more.
        watch.until(f"{DYING} was missed", lambda: not running(DYING) and machines.is_lost(DYING))
        say(f"Slurm missed it after {time.monotonic() - begin:.0f} s")
        time.sleep(5)
        machines.start(DYING, processor)
        watch.until(f"{DYING} was back", lambda: not machines.is_lost(DYING))
        say(f"{DYING} is back after {time.monotonic() - begin:.0f} s")
    while (code := watch.look()) is None:
        pass
    say(f"Snakemake ended with {code}")
    faults = [] if code == 0 else [f"Snakemake ended with {code}; see {WORK}/snakemake.log"]
    faults += [f"{case} ran twice at once" for case in sorted(watch.doubled)]
    return victims, resumable, faults


def attempts(rule="run_case"):
    """All that Slurm has on each case, or on each job of another rule, in the order of time."""
    columns = ["JobIDRaw", "Comment", "NodeList", "State", "ExitCode", "Start", "End"]
    text = run(
        "sacct", "--duplicates", "--allocations", "--parsable2", "--noheader", "--starttime", "now-1day",
        "--format", ",".join(columns),
    )
    found = {}
    for line in text.splitlines():
        row = dict(zip(columns, line.split("|")))
        if row["Comment"].startswith(f"rule_{rule}_"):
            found.setdefault(case_of(row["Comment"]), []).append(row)
    for rows in found.values():
        rows.sort(key=lambda row: row["Start"])
    return found


def check_pieces(cases, one_processor):
    """That what cases share was made once, and by no case: on a node with another processor it is of no use."""
    with open(f"{FLOW}/cases.json") as file:
        pieces = [piece["name"] for piece in json.load(file)["pieces"]]
    made = attempts("make_piece")
    complete = {piece: sum(row["State"] == "COMPLETED" for row in made.get(piece, [])) for piece in pieces}
    say(f"made once for all cases: {', '.join(pieces)}")
    faults = [f"Slurm completed {piece} {count} times" for piece, count in complete.items() if count != 1]
    faults += [] if pieces else ["the cases share nothing"]
    for case in cases:
        with open(f"{REMOTE}/cases/{case}/summary.json") as file:
            stages = json.load(file)["stages"]
        made_again = [s["id"] for s in stages if s["id"] in SHARED and not s["from_cache"]]
        if made_again and one_processor:
            faults.append(f"{case} made again: {', '.join(made_again)}")
    return faults


def without_the_run(value):
    """summary.json without what a run tells of itself."""
    if isinstance(value, dict):
        return {key: without_the_run(v) for key, v in value.items() if key not in KEYS}
    return [without_the_run(v) for v in value] if isinstance(value, list) else value


def files(folder):
    found = set()
    for path, _, names in os.walk(folder):
        found |= {os.path.relpath(os.path.join(path, name), folder) for name in names}
    return found


def compare_cases(cases):
    faults, compared = [], 0
    for case in cases:
        here, there = f"{LOCAL}/cases/{case}", f"{REMOTE}/cases/{case}"
        if files(here) != files(there):
            faults.append(f"{case}: other files than here: {', '.join(sorted(files(here) ^ files(there)))}")
        for name in sorted(files(here) & files(there) - OF_THE_RUN):
            compared += 1
            if not filecmp.cmp(f"{here}/{name}", f"{there}/{name}", shallow=False):
                faults.append(f"{case}: {name} differs")
        summaries = [without_the_run(json.load(open(f"{folder}/summary.json"))) for folder in (here, there)]
        compared += 1
        if summaries[0] != summaries[1]:
            keys = [key for key in summaries[0] if summaries[0][key] != summaries[1].get(key)]
            faults.append(f"{case}: summary.json differs in {', '.join(keys)}")
    say(f"{compared} files compared byte for byte (summary.json: value for value)")
    return faults


def compare_tables():
    rows = []
    for folder in (LOCAL, REMOTE):
        with open(f"{folder}/table.csv") as file:
            rows.append([{k: v for k, v in row.items() if k not in COLUMNS} for row in csv.DictReader(file)])
    return [] if rows[0] == rows[1] else ["table.csv differs"]


def check_attempts(cases, victims, resumable, others):
    """What Slurm says of the cases; prints the table. A case cannot go on on the nodes `others`."""
    found, faults, lost, nodes_after = attempts(), [], [], set()
    print(f"{'case':<58} {'attempts: node, state, time':<60} exit code")
    for case in cases:
        rows = found.get(case, [])
        with open(f"{REMOTE}/cases/{case}/outcome.json") as file:
            code = json.load(file)["exit_code"]
        told = "; ".join(f"{r['NodeList']} {r['State']} {r['Start'][11:]}-{r['End'][11:]}" for r in rows)
        print(f"{case:<58} {told:<60} {code}")
        if code != 0:
            faults.append(f"{case}: exit code {code}")
        complete = [row for row in rows if row["State"] == "COMPLETED"]
        if len(complete) != 1 or rows[-1] != complete[0]:
            faults.append(f"{case}: Slurm completed it {len(complete)} times")
        for earlier, later in zip(rows, rows[1:]):
            if later["Start"] < earlier["End"]:
                faults.append(f"{case}: attempts overlap")
        if len(rows) > 1:
            lost.append(case)
            if not all(row["NodeList"] == DYING and row["State"] == "NODE_FAIL" for row in rows[:-1]):
                faults.append(f"{case}: lost otherwise than with {DYING}")
    if not lost:
        faults.append("no case was lost with a node: nothing was tested")
    if set(lost) != set(victims):
        faults.append(f"lost by Slurm: {', '.join(lost)}; ran on {DYING} when it died: {', '.join(victims)}")
    death = max((row["End"] for rows in found.values() for row in rows[:-1]), default="")
    for case in resumable:
        with open(f"{REMOTE}/cases/{case}/log.txt") as file:
            solved = re.search(r"(\d+) of (\d+) frequencies were solved before", file.read())
        if not solved and not found[case][-1]["NodeList"] in others:
            faults.append(f"{case}: began again from its first frequency")
        elif solved:
            say(f"{case} went on after {solved[1]} of {solved[2]} frequencies")
    for when, did in [
        ("before its death", any(r["NodeList"] == DYING and r["State"] == "COMPLETED" and r["End"] < death
                                 for rows in found.values() for r in rows)),
        ("after its return", any(r["NodeList"] == DYING and r["State"] == "COMPLETED" and r["Start"] > death
                                 for rows in found.values() for r in rows)),
    ]:
        if death and not did:
            faults.append(f"{DYING} completed no case {when}")
    return faults


def other_processor():
    """A /proc/cpuinfo of another model."""
    path = f"{STATE}/cpuinfo"
    with open("/proc/cpuinfo") as source, open(path, "w") as file:
        file.write(re.sub(r"(?m)^(model\s*: ).*$", r"\g<1>1", source.read()))
    return path


def test(arguments):
    program = os.path.abspath(arguments.program)
    shutil.rmtree(WORK, ignore_errors=True)
    os.makedirs(WORK)
    say("the local run")
    run(program, "study", STUDY, "--jobs", "2", "--out", LOCAL)
    run(program, "study", STUDY, "--export-workflow", FLOW, "--out", REMOTE)
    cases = sorted(os.listdir(f"{LOCAL}/cases"))
    say(f"{len(cases)} cases; the cluster comes up")
    machines = Cluster()
    processor = other_processor() if arguments.other_processor else ""
    machines.up({DYING: processor})
    victims, resumable, faults = on_the_cluster(machines, program, arguments.keep_nodes, processor)
    missing = [case for case in cases if not is_complete(case)]
    if missing:
        return faults + [f"{case} has no outcome" for case in missing]
    wait_for("accounts of all cases", lambda: all(
        rows[-1]["End"] != "Unknown" for rows in attempts().values()), 60)
    others = set(cluster.NODES) - {DYING} if arguments.other_processor else set()
    faults += check_attempts(cases, victims, resumable, others)
    faults += check_pieces(cases, not others)
    faults += compare_cases(cases)
    if not os.path.exists(f"{REMOTE}/table.csv"):
        return faults + ["the workflow made no table.csv"]
    faults += compare_tables()
    again = subprocess.run(snakemake(program), cwd=FLOW, capture_output=True, text=True)
    if again.returncode != 0 or "Nothing to be done" not in again.stdout + again.stderr:
        faults.append("Snakemake finds something to do a second time")
    return faults


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=os.path.join(ROOT, "target/release/dovetail"))
    parser.add_argument("--keep-nodes", action="store_true")
    parser.add_argument("--other-processor", action="store_true")
    arguments = parser.parse_args()
    try:
        cluster.enter()
        faults = test(arguments)
    except ClusterError as error:
        sys.exit(f"cluster-test: {error}")
    if owner := os.environ.get("SUDO_UID"):
        run("chown", "-R", owner, WORK, STATE)
    for fault in faults:
        say(fault)
    if faults:
        sys.exit(1)
    say("ok")


if __name__ == "__main__":
    main()
