"""Write blind sets: `python benchmarks/camera_truth FOLDER CASE … [--seeds 1,2,3]`, each with its truth.json."""

import argparse
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1]))

from camera_truth import CASES, write_set, write_truth


def main() -> None:
    """Write every case asked for with every seed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").strip(), epilog=f"cases: {', '.join(CASES)}")
    parser.add_argument("folder", type=Path)
    parser.add_argument("cases", nargs="+", metavar="CASE")
    parser.add_argument("--seeds", default="1", help="whole numbers, separated by commas")
    given = parser.parse_args()
    for case in given.cases:
        for seed in map(int, given.seeds.split(",")):
            folder = given.folder / f"{case.replace(' ', '-')}_{seed}"
            write_truth(folder / "truth.json", write_set(folder, case, seed))
            print(folder)


if __name__ == "__main__":
    main()
