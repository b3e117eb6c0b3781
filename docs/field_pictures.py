"""Write docs/pictures/reconstruct.png and overview.png: views by all methods, and the machine.

tbcad capture exports/ --out captures/knot
tbcad reconstruct captures/knot
python docs/field_pictures.py captures/knot
"""

import sys
from math import radians
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

import tbcad
from tbcad.app.cli.commands.refocus import true_picture
from tbcad.light.reconstruction.field import NAME, read_field
from tbcad.light.simulate.capture.files import captured_scene
from tbcad.light.simulate.scene.rays import camera_around_object

PICTURES = Path(__file__).parent / "pictures"
PLACES_DEG = ((20, 25), (140, 45), (250, 70))
SIZE, CUT = (640, 480), (80, 0, 560, 480)
LABEL_PX, SIDE_PX = 38, 400
BACKGROUND = "white"


def captured_views(folder: Path) -> dict[str, list[Image.Image]]:
    """Views from each place by each method, and the truth."""
    light_field, field = tbcad.LightField.read(folder), read_field(folder / NAME)
    views, scene = tbcad.Views(light_field), captured_scene(folder)
    if scene is None:
        sys.exit(f"{folder} has no object: simulate a capture")
    columns: dict[str, list[Image.Image]] = {}
    for azimuth, elevation in PLACES_DEG:
        place = radians(azimuth), radians(elevation), 640.0
        at = camera_around_object(*place, light_field.capture_mm, SIZE)
        pictures = {
            "nearest rays (paper)": views.view(azimuth, elevation, method="nearest").image,
            "--method depth": views.view(azimuth, elevation, method="depth").image,
            "--method field": tbcad.Views(field).view(azimuth, elevation).image,
            "ray-traced": true_picture(scene, at),
        }
        for name, picture in pictures.items():
            columns.setdefault(name, []).append(Image.fromarray(picture).crop(CUT))
    return columns


def sheet(columns: dict[str, list[Image.Image]]) -> Image.Image:
    """Columns of pictures, each under its name."""
    rows = max(map(len, columns.values()))
    whole = Image.new("RGB", (len(columns) * SIDE_PX, rows * SIDE_PX + LABEL_PX), BACKGROUND)
    draw, font = ImageDraw.Draw(whole), ImageFont.load_default(25)
    for k, (name, pictures) in enumerate(columns.items()):
        draw.text((k * SIDE_PX + 6, 3), name, fill="black", font=font)
        for row, picture in enumerate(pictures):
            place = (k * SIDE_PX, row * SIDE_PX + LABEL_PX)
            whole.paste(picture.resize((SIDE_PX - 2, SIDE_PX - 2)), place)
    return whole


def squared(picture: Image.Image) -> Image.Image:
    """A picture on a square of white."""
    side = max(picture.size)
    whole = Image.new("RGB", (side, side), BACKGROUND)
    whole.paste(picture, ((side - picture.width) // 2, (side - picture.height) // 2))
    return whole


def main(folder: Path) -> None:
    """Write both pictures."""
    columns = captured_views(folder)
    sheet(columns).save(PICTURES / "reconstruct.png", optimize=True)
    shell = Image.open(PICTURES / "shell.png").convert("RGB")
    machine = shell.crop((shell.width // 2, 0, shell.width, shell.height))
    photograph = Image.open(folder / "camera_a.png").convert("RGB")
    overview = {
        "object": columns["ray-traced"][:1],
        "mirrors": [squared(machine)],
        "photograph of one camera": [squared(photograph)],
        "a view of all rays": columns["--method field"][:1],
    }
    sheet(overview).save(PICTURES / "overview.png", optimize=True)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python docs/field_pictures.py CAPTURE")
    main(Path(sys.argv[1]))
