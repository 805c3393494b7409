"""The paper's blade in twenty lines: its peak with friction, and what friction takes.

    python crates/python/examples/paper.py scenes/paper.toml
"""

import sys

import dovetail


def main(scene="scenes/paper.toml", **options):
    run = dovetail.Scene(scene).run(**options)
    peak, linear = run.response.peak("tip"), run.response.linear_peak("tip")
    motion = run.response[peak.index]
    print(f"with friction {1e3 * peak.amplitude_m:.2f} mm at {peak.frequency_hz:.3f} Hz")
    print(f"all pairs stuck {1e3 * linear.amplitude_m:.2f} mm at {linear.frequency_hz:.3f} Hz")
    print(f"estimated error {100 * motion.estimated_error[0]:.0f} %")
    print(f"friction takes {motion.friction_power_w / motion.input_power_w:.0%} of the power")
    print({status: motion.status.count(status) for status in sorted(set(motion.status))})
    return run


if __name__ == "__main__":
    main(*sys.argv[1:])
