"""How long the online path takes to import in a fresh interpreter, best and median of ten, beside NumPy alone."""

import statistics
import subprocess
import sys

PROGRAMS = {
    "numpy": "import numpy",
    "online path": "from sysid_node.online import estimator; from sysid_node.online.alignment import streaming",
    "node, ROS included": "import sysid_node.ros.identifier",
}


def seconds(program: str) -> float:
    """Time that a program's imports take, without the interpreter's own start."""
    timed = f"import time; t = time.perf_counter(); {program}; print(time.perf_counter() - t)"
    return float(subprocess.run([sys.executable, "-c", timed], capture_output=True, text=True, check=True).stdout)


def main() -> None:
    """Print the table."""
    print(f"{'import':<20}{'best ms':>9}{'median ms':>11}")
    for name, program in PROGRAMS.items():
        times = [1e3 * seconds(program) for _ in range(10)]
        print(f"{name:<20}{min(times):>9.0f}{statistics.median(times):>11.0f}")


if __name__ == "__main__":
    main()
