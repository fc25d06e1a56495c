"""python -m benchmarks [--quick] [--long] [--rounds N]: prints one table of ratios."""

from __future__ import annotations

import argparse

from benchmarks import batch, control, inside, processes, recording, samples
from benchmarks.table import markdown


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=inside.__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="of every measurement; the median is printed (default 5)")
    parser.add_argument("--quick", action="store_true", help="one round, and no whole commands")
    parser.add_argument("--long", action="store_true", help="memory over ten simulated minutes, too (minutes)")
    options = parser.parse_args()
    rounds = 1 if options.quick else options.rounds
    rows = [
        *inside.simulate_rows(rounds),
        *inside.engine_rows(rounds),
        *control.control_rows(rounds),
        inside.plan_row(rounds),
        *inside.optimality_rows(),
    ]
    rows += recording.recording_rows(rounds)
    if not options.quick:
        rows += processes.command_rows(rounds)
        rows.append(processes.help_row(rounds))
        rows += samples.sample_rows(rounds)
        rows += [batch.throughput_row(rounds), batch.plugin_row(rounds)]
    if options.long:
        rows += processes.long_rows()
    print(markdown(rows))


if __name__ == "__main__":
    main()
