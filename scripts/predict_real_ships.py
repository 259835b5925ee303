"""Predict measured ships and write `docs/real_ships.md`.

python scripts/predict_real_ships.py [a] [b] [c]

Takes about ten minutes in all, most of it for case a. The measurements lie beside the
checkout.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from real_ships import CASES, Data, get_case
from real_ships.section import draw, put

ROOT = Path(__file__).parents[1]


def main() -> None:
    """Run the cases asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "cases", nargs="*", help=f"some of {', '.join(CASES)}; by default all"
    )
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    options = parser.parse_args()
    page = ROOT / "docs" / "real_ships.md"
    data = Data(ROOT / "tests" / "ships", options.data)
    for case in options.cases or CASES:
        section = get_case(case)(data)
        draw(section, page.parent / "images")
        page.write_text(
            put(page.read_text(encoding="utf-8"), case, section), encoding="utf-8"
        )
        print(section.text)


if __name__ == "__main__":
    main()
