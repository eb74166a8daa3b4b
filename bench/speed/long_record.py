"""Ten hours at 200 Hz: is the cost of a sample constant, is memory flat, do the phases stay right?

    OMP_NUM_THREADS=1 python -m bench.speed.long_record [--hours 10] [--minutes 1]

Samples about level flight, through ``update`` one by one: so many minutes of every hour, and silence in between, which
the estimator meets as a gap; ``--minutes 60`` flies the record in full. Times are the record's own throughout. At the
end a minute's transform is compared with a direct sum whose phases are reduced in extended precision.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.online import estimator
from sysid_node.online.frequency import fourier_transform
from sysid_node.online.settings import OnlineSettings

Array = NDArray[np.float64]
RATE, MINUTE = 200.0, 60.0


def samples(aircraft: Aircraft, start: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """A minute of times (N,) s and samples (N, M) about level flight."""
    at = start + np.arange(round(MINUTE * RATE)) / RATE
    level = [0.3, 0.0, -9.8, 0.0, 0.0, 0.0, aircraft.reference.airspeed, 0.08, 0.0, 1.2, 5.0, 1.0 / RATE]
    spread = [*[0.5] * 3, *[0.1] * 3, 0.3, 0.02, 0.02, 0.0, 0.1, 0.0]
    controls = len(aircraft.control_symbols)
    noise = rng.normal(size=(at.size, len(level) + controls))
    return at, np.array(level + [0.0] * controls) + np.array(spread + [0.05] * controls) * noise


def phase_error(start: float, rng: np.random.Generator) -> float:
    """Largest error of a minute's lines that begins at ``start`` (s), over the largest line."""
    grid = fourier_transform.lines(*OnlineSettings().frequencies)
    at, x = start + np.arange(round(MINUTE * RATE)) / RATE, rng.normal(size=round(MINUTE * RATE))
    state, steps = fourier_transform.start(grid, 1), np.diff(at)
    areas, slants = 0.5 * steps * (x[1:] + x[:-1]), 0.5 * steps**2 * np.diff(x)
    fourier_transform.add(state, at[:-1].tolist(), at[1:].tolist(), areas[:, None], slants[:, None])
    lines, F = fourier_transform.current(state)[:, 0], grid.count
    phase = np.outer(grid.omega.astype(np.longdouble), at[:-1].astype(np.longdouble) + 0.5 * steps)
    wave = np.exp(-1j * np.remainder(phase, 2 * np.longdouble(np.pi)).astype(float))
    phi = 0.5 * np.outer(grid.omega, steps)
    slope = (np.sin(phi) - phi * np.cos(phi)) / (phi**2 * steps)
    direct = (wave * (areas * np.sin(phi) / phi - 1j * slants * slope)).sum(axis=1)
    return float(np.abs(lines[:F] + 1j * lines[F : 2 * F] - direct).max() / np.abs(direct).max())


def resident() -> float:
    """Memory that the process holds now, MB (Linux)."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * 4096 / 1e6


def main() -> None:
    """Print cost and memory along the record, and the phase error at its end."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hours", type=int, default=10)
    parser.add_argument("--minutes", type=int, default=1, help="of every hour that are flown")
    options = parser.parse_args()
    aircraft, rng = load_aircraft("cdrw"), np.random.default_rng(1)
    state = estimator.init(aircraft, OnlineSettings())
    print(f"{'after hour':>10}{'us a sample':>14}{'memory, MB':>14}")
    for hour in range(options.hours):
        seconds, count = 0.0, 0
        for minute in range(options.minutes):
            at, values = samples(aircraft, 3600.0 * hour + MINUTE * minute, rng)
            rows = list(zip(at.tolist(), values.tolist(), strict=True))
            begin = time.process_time()
            for t, sample in rows:
                estimator.update(state, t, sample)
            seconds, count = seconds + time.process_time() - begin, count + len(rows)
        print(f"{hour:>10}{1e6 * seconds / count:>14.1f}{resident():>14.1f}", flush=True)
    print(f"phase error after {options.hours} h: {phase_error(3600.0 * options.hours, rng):.1e} of the largest line")


if __name__ == "__main__":
    main()
