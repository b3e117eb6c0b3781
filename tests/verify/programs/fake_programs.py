"""Small programs that pretend to be the real ones: well-behaved, or bad in one way each."""

from __future__ import annotations

import sys
from pathlib import Path

SEEN = {"solids": 1, "invalid": 0, "open": 0, "loose": 0, "spheres": 7, "volume": 1000.0}

INFO = """
[2026-01-02 03:04:05.678901] [0x00007f4971762d80] [trace]   Initializing StaticPrintConfigs
[given.stl]
size_x = 10.0
number_of_facets = 1200
manifold = yes
number_of_parts =  1
volume = 1000.0
"""

GCODE = """
G1 X0 Y0
; filament used [mm] = 420.00
; estimated printing time (normal mode) = 1d 2h 30m 36s
; filament_diameter = 1.75
"""

GMSH = """
from types import SimpleNamespace as Space
def initialize(**options): print("chatter")
occ = Space(
    importShapes=lambda path: open(path).read() == "this is part.step" or 1 / 0,
    synchronize=lambda: None,
    getMass=lambda dim, tag: 1000.25,
)
model = Space(
    occ=occ,
    getEntities=lambda dim: [(3, 0)] if dim == 3 else [(2, tag) for tag in range(9)],
    getType=lambda dim, tag: "Sphere" if tag < 7 else "Plane",
)
option = Space(setNumber=lambda name, value: None)
"""

GOOD = {
    "freecadcmd": f"import json; json.dump({SEEN!r}, open('answer.json', 'w'))",
    "gmsh": GMSH,
    "prusa-slicer": f"""
import sys
if "--output" in sys.argv:
    open(sys.argv[sys.argv.index("--output") + 1], "w").write({GCODE!r})
else:
    print({INFO!r})
""",
}

BAD = {
    "hangs": "import time\nwhile True: time.sleep(1)",
    "crashes": "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)",
    "crashes at last": "{good}\nimport os, signal; sys_stdout = __import__('sys').stdout\n"
    "sys_stdout.flush(); os.kill(os.getpid(), signal.SIGSEGV)",
    "prints rubbish": "import os; os.write(1, os.urandom(5000))\n"
    "open('answer.json', 'wb').write(os.urandom(500))\n"
    "open('sliced.gcode', 'wb').write(os.urandom(500))",
    "prints without end": "while True: print('manifold = yes ' * 500)",
    "says nothing": "",
    "answers with words": "print('manifold = perhaps\\nsolids one volume big\\n')\n"
    "open('answer.json', 'w').write('{\"solids\": \"1\", \"volume\": NaN}')\n"
    "open('sliced.gcode', 'w').write('; filament used [mm] = lots\\n')",
    "answers with a list": "open('answer.json', 'w').write('[' * 50_000)",
    "gives up": "{good}\nprint('[error] no [/such] thing'); raise SystemExit(1)",
}


def install(folder: Path, **bodies: str) -> Path:
    """Put Python programs into a folder; `_` in a name stands for `-`, gmsh is a module."""
    folder.mkdir(exist_ok=True)
    for name, body in bodies.items():
        path = folder / ("gmsh.py" if name == "gmsh" else name.replace("_", "-"))
        path.write_text(body if name == "gmsh" else f"#!{sys.executable} -IS\n{body}\n")
        path.chmod(0o755)
    return folder


def install_good(folder: Path, **others: str) -> Path:
    return install(folder, **{name.replace("-", "_"): body for name, body in GOOD.items()} | others)
