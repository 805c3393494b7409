"""dovetail on the scene, with its processor seconds per frequency: those of `dovetail run` less those of `dovetail static`.

    dovetail_run.py SCENE HARMONICS OUT.json [SAMPLES]
"""

import csv
import json
import resource
import subprocess
import sys
import tempfile


def processor_seconds(command, scene, settings, out):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        ["target/release/dovetail", command, scene, "--threads", "1", "--quiet", "--out", out]
        + [word for setting in settings for word in ("--set", setting)],
        check=True,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    scene, harmonics, target = sys.argv[1:4]
    settings = [f"response.harmonics={harmonics}"] + [f"response.samples={n}" for n in sys.argv[4:]]
    with tempfile.TemporaryDirectory() as out:
        whole = processor_seconds("run", scene, settings, out)
        with open(f"{out}/response.csv") as file:
            rows = list(csv.DictReader(file))
        with open(f"{out}/summary.json") as file:
            stages = json.load(file)["stages"]
        before = processor_seconds("static", scene, settings, out)
    wall = next(stage["seconds"] for stage in stages if stage["id"] == "response")
    points = []
    for row in rows:
        if float(row["retention_n"]) != 0.0:
            sys.exit(f"{row['frequency_hz']} Hz: dovetail held the mean along the slot, the others do not: another problem")
        points.append(
            dict(hz=float(row["frequency_hz"]), tip_m=float(row["tip_h1_amplitude_m"]), residual=float(row["residual"]))
            | dict(converged=row["outcome"] == "converged", iterations=int(row["newton_iterations"]))
            | dict(slipping=int(row["slipping_pairs"]), opening=int(row["opening_pairs"]))
            | dict(seconds=wall / len(rows), processor_s=(whole - before) / len(rows))
        )
    with open(target, "w") as file:
        json.dump(dict(points=points), file)


if __name__ == "__main__":
    main()
