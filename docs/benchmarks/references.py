"""Write problems.json: the benchmark problems with their inputs and reference values.

    python docs/benchmarks/references.py

Reference values are closed forms, solutions by another method, or numbers printed in a publication; none comes from the
solver that the benchmarks test. Lengths are in m, loads in N, stresses in Pa, times in s.
"""

import json
from pathlib import Path

import references_moved
import references_pressed

FILE = Path(__file__).with_name("problems.json")

PROBLEMS = {
    "hertz": references_pressed.hertz_ball,
    "line-contact": references_pressed.line_contact,
    "westergaard": references_pressed.westergaard,
    "compliant-layer": lambda: references_pressed.layers(0.1),
    "stiff-layer": lambda: references_pressed.layers(4.0),
    "pavement": references_pressed.pavement,
    "thin-sample": references_pressed.thin_sample,
    "tribofilm": references_pressed.tribofilm,
    "lee-radok": references_pressed.lee_and_radok,
    "ting": references_pressed.ting_unloading,
    "creeping-layer": references_pressed.creeping_layer,
    "hunter": references_moved.sliding_line,
    "cattaneo-mindlin": references_moved.partial_slip,
    "spence": references_moved.compression_with_friction,
    "carter": references_moved.carter,
    "bentall-johnson": references_moved.free_rolling,
    "viscoelastic-rolling": references_moved.viscoelastic_rolling,
    "kalker": references_moved.kalker,
    "jkr": references_pressed.jkr,
    "maugis": references_pressed.maugis_dugdale,
    "archard": references_moved.archard,
    "jaeger": references_moved.flash_temperature,
}


def main() -> None:
    FILE.write_text(
        json.dumps({name: make() for name, make in PROBLEMS.items()}, indent=1) + "\n",
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
