"""What the paper's joint costs where the scene leaves physics out: the table of docs/performance.md.

    cargo build --release && python3 benches/only_what_is_asked.py [--points 200] [--out output/asked]

Each row is one run of scenes/paper.toml on the ready mesh, without the cache and without the response for comparison; unknowns and
wall seconds from the stages of summary.json, processor seconds of the whole run. Standard library only.
"""

import argparse
import json
import os
import re
import resource
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.append(os.path.join(ROOT, "scripts"))
import origin  # noqa: E402
PROGRAM = os.path.join(ROOT, "target/release/dovetail")
PULL = "load=[{ on = 'blade_tip', force_n = 7000, direction = [0, 0, 1] }]"
LIGHT = "excitation.0.force_n=0.2"

# What is left out: settings, and whether the jaw is.
ROWS = {
    "nothing": ([], False),
    "harmonics 2 and 3": (["response.harmonics=1"], False),
    "friction": (["contact.*.friction=0"], False),
    "opening and slip on one flank (bonded)": (["contact.left.law=bonded"], False),
    "opening and slip on both flanks (bonded)": (["contact.*.law=bonded"], False),
    "the jaw (rigid ground)": ([], True),
    "rotation (pulled at the tip instead)": (["rotation=", PULL, LIGHT], False),
    "all of these": (["contact.*.law=bonded", "rotation=", PULL, "response.harmonics=1"], True),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=200, help="frequencies of the response")
    parser.add_argument("--out", default=os.path.join(ROOT, "output/asked"))
    arguments = parser.parse_args()
    head = ["left out", "unknowns solved for: prestress", "interiors", "static state", "response",
            "s: finite elements", "reduction", "static state", "response", "processor s, whole run"]
    print("| " + " | ".join(head) + " |\n|" + " --- |" * len(head))
    for name, (sets, alone) in ROWS.items():
        print("| " + " | ".join([name] + row(sets, alone, arguments)) + " |", flush=True)


def row(sets, alone, arguments):
    os.makedirs(arguments.out, exist_ok=True)
    scene = os.path.join(arguments.out, "scene.toml")
    with open(scene, "w", encoding="utf-8") as file:
        file.write(text(alone))
    command = [PROGRAM, "run", scene, "--no-cache", "--quiet", "--out", arguments.out]
    for setting in [f"response.points={arguments.points}", "response.compare_harmonics="] + sets:
        command += ["--set", setting]
    before = processor_s()
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    used = processor_s() - before
    if done.returncode not in (0, 3):
        raise SystemExit(f"{' '.join(command)}\n{done.stderr}")
    with open(os.path.join(arguments.out, "summary.json"), encoding="utf-8") as file:
        summary = json.load(file)
    stages = {s["id"]: s for s in summary["stages"]}
    wanted = [stages.get(n) for n in ("finite_elements", "reduction", "static_state", "response")]
    unconverged = len(summary["response"]["unconverged"])
    unknowns = [" + ".join(map(str, s["unknowns"])) if s and s["unknowns"] else "none" for s in wanted]
    seconds = [f"{s['seconds']:.2f}" if s else "none" for s in wanted]
    note = f" ({unconverged} of {arguments.points} open)" if unconverged else ""
    return unknowns + seconds + [f"{used:.1f}{note}"]


def text(alone):
    """The scene on the ready mesh; without the jaw where the blade stands alone."""
    with open(os.path.join(ROOT, "scenes/paper.toml"), encoding="utf-8") as file:
        scene = file.read()
    mesh = os.path.join(ROOT, "meshes/dovetail.msh")
    section = scene[scene.index("[mesh]"):scene.index("[[body]]")]
    scene = scene.replace(section, f'[mesh]\nfile = "{mesh}"\nmetres_per_unit = 1e-3\n\n')
    if alone:
        jaw = scene[scene.rindex("[[body]]"):scene.index("[rotation]")]
        scene = scene.replace(jaw, "").replace('["blade", "jaw"]', '["blade"]')
        scene = re.sub(r"second = .*\n", "", scene)
    return scene


def processor_s():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    print(origin.line() + "\n")
    main()
